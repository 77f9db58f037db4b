// The ECG from potentials of tissue cells, whole chain: geometry, weights, lead fields, leads.
// A ball of isotropic tissue with a potential that is linear in space is an exact dipole: outside it, phi is
// that of p = -sigma_i grad V x volume at its centre, whatever its radius (Jackson, Classical
// Electrodynamics, section 4.4).
#include <cmath>
#include <cstdio>
#include <numbers>

#include "solver/lead_weights.hpp"
#include "tests/slab.hpp"
#include "tests/verification/sphere.hpp"

namespace cohort::test {
namespace {

constexpr double ball_radius = 16, sigma_i = 0.17, slope = 2;  // mm, mS/mm, mV/mm

Scene ball_scene(TorsoKind torso) {
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.shapes = {{"ball", Shape::Kind::ellipsoid, {}}};
  scene.regions = {{"tissue", "ball", true, Region::Fibres::none}};
  scene.torso = torso;
  scene.ecg.emplace();
  return scene;
}

std::vector<std::pair<std::string, double>> ball_values(TorsoKind torso, double dx, double torso_dx) {
  std::vector<std::pair<std::string, double>> set = {
      {"grid.dx_mm", dx},
      {"electrophysiology.intracellular_longitudinal_mS_per_mm", sigma_i},
      {"electrophysiology.intracellular_transverse_mS_per_mm", sigma_i},
      {"torso.conductivity_mS_per_mm", 0.2}};
  const char* axes[] = {".x", ".y", ".z"};
  for (const char* axis : axes)
    set.emplace_back(std::string("geometry.shapes.ball.ellipsoid.semi_axes_mm") + axis, ball_radius);
  for (const char* angle : {"azimuth_deg", "elevation_deg", "roll_deg"})
    set.emplace_back(std::string("torso.heart.") + angle, 0);
  // The ball's centre, the origin of the heart's frame, lies off the middle of the torso.
  const double place[] = {20, -15, 25};
  for (size_t a = 0; a < 3; ++a) {
    set.emplace_back(std::string("torso.heart.point_mm") + axes[a], 0);
    set.emplace_back(std::string("torso.heart.position_mm") + axes[a], place[a]);
  }
  if (torso == TorsoKind::ellipsoid) {
    set.emplace_back("torso.dx_mm", torso_dx);
    set.emplace_back("torso.half_width_mm", sphere::radius_mm);
    set.emplace_back("torso.half_depth_mm", sphere::radius_mm);
    set.emplace_back("torso.lower_mm", -sphere::radius_mm);
    set.emplace_back("torso.upper_mm", sphere::radius_mm);
  }
  // Electrodes all around, on the sphere.
  for (size_t e = 0; e < electrode_names.size(); ++e) {
    const double polar = 0.5 + 0.25 * static_cast<double>(e), around = 2.4 * static_cast<double>(e);
    const double direction[] = {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                std::cos(polar)};
    for (size_t a = 0; a < 3; ++a)
      set.emplace_back("torso.electrodes." + std::string(electrode_names[e]) + "_mm" + axes[a],
                       sphere::radius_mm * direction[a]);
  }
  return set;
}

struct Ball : Slab {
  Ball(TorsoKind torso, double dx, double torso_dx)
      : Slab(ball_scene(torso), ball_values(torso, dx, torso_dx)) {}

  // Largest error of the eight leads over three directions of the dipole, relative to the largest lead.
  double error() {
    LeadWeights weights(*launcher, scene, definitions, 1);
    weights.assemble(*tissue, *diffusion, parameters, {&member, 1});
    std::vector<float> w(static_cast<size_t>(tissue->stride) * LeadWeights::leads);
    launcher->queue().enqueueReadBuffer(weights.weights(), CL_TRUE, 0, w.size() * sizeof(float), w.data());

    const std::array<Point, 9> electrodes = electrode_places(scene.torso, scene.parameters, member.values);
    const Pose pose = heart_pose(scene.parameters, member.values);
    const Point centre = pose({0, 0, 0});
    const double volume = 4.0 / 3 * std::numbers::pi * std::pow(ball_radius, 3);
    double largest = 0, worst = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      std::array<double, LeadWeights::leads> lead{}, exact{};
      for (std::size_t i = 0; i < tissue->regions.size(); ++i) {
        if (tissue->regions[i] == 255) continue;
        const int cell = tissue->first_cells[i / 8] + static_cast<int>(i % 8);
        const std::array<int, 3> index = {cell % grid.cells[0], cell / grid.cells[0] % grid.cells[1],
                                          cell / (grid.cells[0] * grid.cells[1])};
        const double V = slope * (grid.origin_mm[axis] + grid.dx_mm * (index[axis] + 0.5));
        for (size_t q = 0; q < lead.size(); ++q)
          lead[q] += w[q * static_cast<size_t>(tissue->stride) + i] * V;
      }
      const double moment = -sigma_i * slope * volume;  // uA mm
      Point direction{};                                // in the torso's frame
      for (size_t row = 0; row < 3; ++row) direction[row] = pose.rotation[row * 3 + axis];
      std::array<double, 9> phi{};
      for (size_t e = 0; e < 9; ++e) {
        const Point from = electrodes[e];
        const auto Z = [&](const Point& x) {
          if (scene.torso == TorsoKind::ellipsoid) return sphere::neumann(x, from);
          const Point d = {x[0] - from[0], x[1] - from[1], x[2] - from[2]};
          return 1 / (4 * std::numbers::pi * std::sqrt(sphere::dot(d, d)));
        };
        phi[e] = moment * sphere::along(Z, centre, direction) / 0.2;
      }
      const double wilson = (phi[0] + phi[1] + phi[2]) / 3;
      exact[0] = phi[1] - phi[0];
      exact[1] = phi[2] - phi[0];
      for (size_t v = 0; v < 6; ++v) exact[2 + v] = phi[3 + v] - wilson;
      for (size_t q = 0; q < exact.size(); ++q) {
        largest = std::max(largest, std::abs(exact[q]));
        worst = std::max(worst, std::abs(lead[q] - exact[q]));
      }
    }
    return worst / largest;
  }
};

TEST(Ecg, PolarisedBallInAnUnboundedMediumIsADipole) {
  double previous = 1;
  for (const double dx : {4.0, 2.0, 1.0}) {
    const double error = Ball(TorsoKind::unbounded, dx, 5).error();
    std::printf("unbounded      dx %.0f mm               error %.3f %%\n", dx, 100 * error);
    EXPECT_LT(error, previous);
    previous = error;
  }
  EXPECT_LT(previous, 0.02);
}

TEST(Ecg, PolarisedBallInAnInsulatedSphereIsADipole) {
  double previous = 1;
  const std::pair<double, double> spacings[] = {{4, 10}, {2, 5}, {1, 2.5}};
  for (const auto& [dx, torso_dx] : spacings) {
    const double error = Ball(TorsoKind::ellipsoid, dx, torso_dx).error();
    std::printf("insulated      dx %.0f mm, torso %4.1f mm  error %.3f %%\n", dx, torso_dx, 100 * error);
    EXPECT_LT(error, previous);
    previous = error;
  }
  EXPECT_LT(previous, 0.02);
}

}  // namespace
}  // namespace cohort::test
