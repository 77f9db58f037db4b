// Lead fields against exact solutions and against the forward problem.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/verification/lead_samples.hpp"
#include "tests/verification/sphere.hpp"

namespace cohort {
namespace {

struct Dipole {
  Point place, moment;  // mm, uA mm
};
/// In the frame of the sphere; the nearest electrode is 35 mm away.
const std::vector<Dipole> dipoles = {{{0.3, -0.2, 0.7}, {1, 0, 0}}, {{0.3, -0.2, 0.7}, {0, 0.6, -0.8}},
                                     {{31, 12, -17}, {0, 0, 1}},    {{31, 12, -17}, {0.6, -0.64, 0.48}},
                                     {{-28, 33, 30}, {1, 0, 0}},    {{-28, 33, 30}, {0.36, 0.48, 0.8}},
                                     {{4, -57, -12}, {0, 1, 0}},    {{4, -57, -12}, {0.8, 0, 0.6}}};
constexpr double spacing_mm = 2;  // of the points that a dipole's gradient is taken from: a cell of tissue

class LeadField : public testing::Test {
 protected:
  Device device{devices().at(0)};
};

/// Largest over the dipoles of the RMS error of the potentials between electrodes, relative to their RMS.
template <typename Exact>
double dipole_error(Device& device, const Scene& scene, const Exact& exact) {
  Torso torso(device, scene);
  const std::vector<double> values = scene.parameters.values();
  std::vector<Point> points;
  for (const Dipole& d : dipoles)
    for (const double side : {-0.5, 0.5}) {
      Point p = d.place;
      for (std::size_t i = 0; i < 3; ++i) p[i] += side * spacing_mm * d.moment[i];
      points.push_back(p);
    }
  const std::vector<double> z = sample(device, scene, torso, values, points);
  double largest = 0;
  for (std::size_t n = 0; n < dipoles.size(); ++n) {
    std::array<double, 9> potential, wanted;
    for (std::size_t e = 0; e < 9; ++e) {
      potential[e] = (z[9 * (2 * n + 1) + e] - z[9 * 2 * n + e]) / spacing_mm;
      wanted[e] = exact(dipoles[n], torso.fields(values).electrodes_mm[e]);
    }
    double error = 0, size = 0;
    for (std::size_t a = 0; a < 9; ++a)
      for (std::size_t b = 0; b < a; ++b) {
        error += std::pow(potential[a] - potential[b] - wanted[a] + wanted[b], 2);
        size += std::pow(wanted[a] - wanted[b], 2);
      }
    largest = std::max(largest, std::sqrt(error / size));
  }
  return largest;
}

TEST_F(LeadField, ExactSphereEqualsItsSeries) {
  for (const Dipole& d : dipoles)
    for (const Point& e : {Point{100, 0, 0}, Point{-60, 48, 64}}) {
      const double closed =
          sphere::along([&](const Point& x) { return sphere::neumann(x, e); }, d.place, d.moment);
      const double series =
          sphere::along([&](const Point& x) { return sphere::neumann_series(x, e); }, d.place, d.moment);
      EXPECT_NEAR(closed, series, 1e-7 * std::abs(series) + 1e-12);
    }
}

TEST_F(LeadField, DipoleInInsulatedSphere) {
  std::vector<double> errors;
  std::printf("  dx_mm  largest RMS error\n");
  for (const double dx : {10.0, 5.0, 2.5}) {
    const Scene scene = sphere::scene(dx);
    const double sigma = 0.25;
    errors.push_back(dipole_error(device, scene, [&](const Dipole& d, const Point& e) {
      return sphere::along([&](const Point& x) { return sphere::neumann(x, e); }, d.place, d.moment) / sigma;
    }));
    std::printf("  %5.2f  %.5f\n", dx, errors.back());
  }
  EXPECT_LT(errors[1], errors[0] / 2);
  EXPECT_LT(errors[2], errors[1] / 2);
  EXPECT_LT(errors[2], 0.02);
}

TEST_F(LeadField, DipoleInUnboundedMedium) {
  Scene scene = sphere::scene(10);
  ParameterTable electrodes = scene.parameters;
  scene.torso = TorsoKind::unbounded;
  scene.parameters = {};
  declare_torso(scene.parameters, scene.torso);
  for (int i = 0; i < scene.parameters.size(); ++i)
    scene.parameters[i].value = electrodes[electrodes.index(scene.parameters[i].path)].value;
  const double error =
      dipole_error(device, scene, [](const Dipole& d, const Point& e) {  // p . (e - x) / (4 pi sigma r^3)
        const Point r = {e[0] - d.place[0], e[1] - d.place[1], e[2] - d.place[2]};
        return sphere::dot(d.moment, r) / (4 * std::numbers::pi * 0.25 * std::pow(sphere::dot(r, r), 1.5));
      });
  EXPECT_LT(error, 2e-3);  // (1 mm / 35 mm)^2 of the difference, and single precision
}

/// A dipole in the default torso, as two opposite currents spread by the splines that sample the lead fields:
/// its potentials at the electrodes by a forward solve equal its lead-field values.
TEST_F(LeadField, ReciprocalToForwardSolve) {
  Scene scene;
  scene.torso = TorsoKind::cylinder;
  declare_torso(scene.parameters, scene.torso);
  scene.parameters[scene.parameters.index("torso.dx_mm")].value = 7;
  scene.parameters[scene.parameters.index("torso.conductivity_mS_per_mm")].value = 1;
  const std::vector<double> values = scene.parameters.values();
  Torso torso(device, scene);
  const LeadFields& lead = torso.fields(values);
  const auto n = [&](std::size_t axis) { return static_cast<std::size_t>(lead.extent[axis]); };
  const std::size_t field = n(0) * n(1) * n(2);

  std::vector<Point> points;
  std::vector<double> source(9 * field);  // each of the nine right-hand sides holds another dipole
  for (std::size_t d = 0; d < 9; ++d) {
    const double angle = 0.7 * static_cast<double>(d);
    const Point centre = {29 + 20 * std::cos(angle), -33 + 20 * std::sin(angle),
                          -20 + 5.0 * static_cast<double>(d)};
    for (const double side : {-1.0, 1.0}) {
      const Point p = {centre[0] + side * std::sin(angle), centre[1] + side * 0.5,
                       centre[2] + side * std::cos(angle)};
      points.push_back(p);
      std::array<std::array<double, 3>, 3> w;
      std::array<std::size_t, 3> first;
      for (std::size_t i = 0; i < 3; ++i) {  // quadratic B-splines
        const double s = (p[i] - lead.origin_mm[i]) / lead.dx_mm, nearest = std::floor(s + 0.5),
                     f = s - nearest;
        w[i] = {0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)};
        first[i] = static_cast<std::size_t>(nearest) - 1;
      }
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t j = 0; j < 3; ++j)
          for (std::size_t i = 0; i < 3; ++i)
            source[d * field + ((first[2] + k) * n(1) + first[1] + j) * n(0) + first[0] + i] +=
                side * w[2][k] * w[1][j] * w[0][i];
    }
  }
  const std::vector<double> z = sample(device, scene, torso, values, points);
  const std::vector<double> weights = download(device, torso.electrode_weights(), 9 * 64, false);
  std::vector<int> window(27);
  device.queue().enqueueReadBuffer(torso.electrode_windows(), CL_TRUE, 0, window.size() * sizeof(int),
                                   window.data());
  const cl::Buffer rhs = upload(device, source, false);
  cl::Buffer solution = upload(device, std::vector<double>(9 * field), false);
  const EllipticResult result = torso.solver().solve(rhs, solution, 1e-6);
  EXPECT_LT(result.relative_residual, 1e-5);
  const std::vector<double> phi = download(device, solution, 9 * field, false);

  double largest = 0;
  for (std::size_t d = 0; d < 9; ++d) {
    std::array<double, 9> forward{}, lead_value;
    double size = 0;
    for (std::size_t e = 0; e < 9; ++e) {
      for (std::size_t m = 0; m < 64; ++m) {
        const std::size_t i = static_cast<std::size_t>(window[3 * e]) + m % 4,
                          j = static_cast<std::size_t>(window[3 * e + 1]) + m / 4 % 4,
                          k = static_cast<std::size_t>(window[3 * e + 2]) + m / 16;
        if (weights[64 * e + m] != 0)
          forward[e] += weights[64 * e + m] * phi[d * field + (k * n(1) + j) * n(0) + i];
      }
      lead_value[e] = z[9 * (2 * d + 1) + e] - z[9 * 2 * d + e];
      size = std::max(size, std::abs(lead_value[e] - lead_value[0]));
    }
    for (std::size_t e = 1; e < 9; ++e)
      largest = std::max(largest, std::abs(forward[e] - forward[0] - lead_value[e] + lead_value[0]) / size);
  }
  std::printf("  largest difference, relative: %.2e\n", largest);
  EXPECT_LT(largest, 1e-3);
}

/// What flows from the electrode through a horizontal plane is what the sink takes beyond it.
TEST_F(LeadField, CurrentThroughAPlane) {
  Scene scene;
  scene.torso = TorsoKind::cylinder;
  declare_torso(scene.parameters, scene.torso);
  scene.parameters[scene.parameters.index("torso.dx_mm")].value = 10;
  const std::vector<double> values = scene.parameters.values();
  Torso torso(device, scene);
  const LeadFields& lead = torso.fields(values);
  const auto n = [&](std::size_t axis) { return static_cast<std::size_t>(lead.extent[axis]); };
  const std::size_t plane = n(0) * n(1), field = plane * n(2);
  const std::vector<double> z = download(device, lead.potential, 9 * field, false);
  const std::vector<double> g = download(device, torso.solver().conductance(), 3 * field, false);
  const std::vector<double> inverse = download(device, torso.solver().inverse_diagonal(), field, false);
  const auto active = [&](std::size_t from, std::size_t to) {
    return static_cast<double>(std::count_if(inverse.begin() + static_cast<std::ptrdiff_t>(from),
                                             inverse.begin() + static_cast<std::ptrdiff_t>(to),
                                             [](double d) { return d > 0; }));
  };
  for (std::size_t e = 0; e < 9; ++e)
    for (const std::size_t k : {n(2) / 3, n(2) / 2, 3 * n(2) / 4}) {
      double current = 0;  // downwards through the lower faces of layer k
      for (std::size_t c = k * plane; c < (k + 1) * plane; ++c)
        current += g[2 * field + c] * (z[e * field + c] - z[e * field + c - plane]);
      const double sink_below = active(0, k * plane) / active(0, field);
      const double electrode_k = (lead.electrodes_mm[e][2] - lead.origin_mm[2]) / lead.dx_mm;
      if (std::abs(electrode_k - static_cast<double>(k)) < 4)
        continue;  // the plane cuts the spread electrode
      const double wanted = electrode_k > static_cast<double>(k) ? sink_below : sink_below - 1;
      EXPECT_NEAR(current, wanted, 2e-4) << electrode_names[e] << " layer " << k;
    }
}

}  // namespace
}  // namespace cohort
