// Arrival times of the eikonal equation against exact solutions.
#include "solver/eikonal.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>

#include "solver/conduction.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Vector = std::array<double, 3>;
constexpr double along = 0.6, across = 0.25;  // mm/ms

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector unit(const Vector& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

// A slab with an eikonal solver, uniform speeds.
struct Wave {
  Wave(Vector size, double dx, const Vector& fibre, Precision precision = Precision::single_)
      : slab(size, dx, precision, "mitchell_schaeffer",
             {{"geometry.fibres.direction.x", fibre[0]},
              {"geometry.fibres.direction.y", fibre[1]},
              {"geometry.fibres.direction.z", fibre[2]}}),
        eikonal(*slab.launcher, slab.scene, slab.definitions) {
    std::vector<double> both(static_cast<size_t>(slab.tissue->stride), along);
    both.resize(2 * both.size(), across);
    speed = upload(both);
  }
  cl::Buffer upload(const std::vector<double>& field) {
    const cl::Buffer buffer = device().allocate(field.size() * real_bytes(slab.scene.precision));
    slab.write(buffer, field);
    return buffer;
  }
  std::vector<double> arrival() {
    return slab.read(eikonal.arrival(), static_cast<size_t>(slab.tissue->stride));
  }
  int cell_at(const Vector& p) const {
    int result = -1;
    double nearest = 1e9;
    slab.each_cell([&](std::size_t i, const Vector& c) {
      const Vector d = {c[0] - p[0], c[1] - p[1], c[2] - p[2]};
      if (dot(d, d) < nearest) nearest = dot(d, d), result = static_cast<int>(i);
    });
    return result;
  }

  Slab slab;
  Eikonal eikonal;
  cl::Buffer speed;
};

// Time that a straight path d takes.
double flight(const Vector& d, const Vector& f) {
  const double l = dot(d, f);
  return std::sqrt(l * l / (along * along) + std::max(0.0, dot(d, d) - l * l) / (across * across));
}

struct Errors {
  double mean = 0, largest = 0, last = 0;
};

Errors point_source(double dx, const Vector& fibre) {
  Wave wave({60, 40, 20}, dx, fibre);
  const int source = wave.cell_at({20, 20, 10});
  const Vector origin = wave.slab.tissue->centre(static_cast<size_t>(source));
  const Eikonal::Source sources[] = {{source, 0}};
  wave.eikonal.solve(*wave.slab.tissue, wave.speed, nullptr, nullptr, sources);
  const auto start = std::chrono::steady_clock::now();
  wave.eikonal.solve(*wave.slab.tissue, wave.speed, nullptr, nullptr, sources);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<double> T = wave.arrival();
  Errors errors;
  int cells = 0;
  wave.slab.each_cell([&](std::size_t i, const Vector& c) {
    const double exact = flight({c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]}, fibre);
    errors.mean += std::abs(T[i] - exact);
    errors.largest = std::max(errors.largest, std::abs(T[i] - exact));
    errors.last = std::max(errors.last, exact);
    ++cells;
  });
  errors.mean /= cells;
  std::printf(
      "point source, dx %.1f: mean error %.3f ms, largest %.3f of %.1f ms; %d sweeps, %d cells, %.4f s\n", dx,
      errors.mean, errors.largest, errors.last, wave.eikonal.sweeps(), cells, seconds);
  return errors;
}

TEST(Eikonal, PointSourceInUniformTissue) {
  for (const Vector& f : {Vector{1, 0, 0}, unit({1, 0.7, 0.4})})
    for (const double dx : {4.0, 2.0, 1.0}) point_source(dx, f);
}

Cable cable_of(const std::string& model) {
  Cable cable{model, {}, 0, 35.714, 2};
  for (const Parameter& p : read_cell_model(model).parameters) cable.cell.push_back(p.value);
  return cable;
}

// The frozen gate's front of Mitchell and Schaeffer's cubic: exact.
TEST(Conduction, FrozenGate) {
  Cable cable = cable_of("mitchell_schaeffer");
  const CellModel model = read_cell_model("mitchell_schaeffer");
  double tau_in = 0, tau_out = 0;
  for (size_t k = 0; k < model.parameters.size(); ++k) {
    const std::string& name = model.parameters[k].path;
    if (name == "tau_close_ms" || name == "tau_open_ms") cable.cell[k] = 1e9;
    if (name == "tau_in_ms") tau_in = cable.cell[k];
    if (name == "tau_out_ms") tau_out = cable.cell[k];
  }
  Conduction conduction(device(), Precision::single_);
  const auto start = std::chrono::steady_clock::now();
  const Front front = conduction.converged({cable})[0];
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double root = std::sqrt(1 - 4 * tau_in / tau_out);
  const double exact = std::sqrt(1 / (2 * tau_in)) * ((1 + root) / 2 - (1 - root));
  std::printf(
      "frozen gate: %.4f mm/ms for 1 mm2/ms, exact %.4f; width %.2f mm, latency %.3f ms; "
      "%.2f s\n",
      front.speed, exact, front.width_mm, front.latency_ms, seconds);
  EXPECT_NEAR(front.speed / exact, 1, 0.01);
}

TEST(Conduction, Models) {
  Conduction conduction(device(), Precision::single_);
  for (const char* name : {"mitchell_schaeffer", "ten_tusscher_panfilov"}) {
    const Cable cable = cable_of(name);
    const auto start = std::chrono::steady_clock::now();
    const Front front = conduction.converged({cable})[0];
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%s: %.4f mm/ms for 1 mm2/ms; width %.2f mm, latency %.3f ms; %.2f s\n", name, front.speed,
                front.width_mm, front.latency_ms, seconds);
    for (const double spacing : {0.6, 0.3, 0.15, 0.1, 0.075})
      std::printf("  on a grid of %.3f: %.4f\n", spacing, conduction.on_grid(cable, spacing));
  }
}

// The slab of Niederer et al. 2011 by reaction-eikonal at `dx`: activation of its nine points, ms.
std::vector<double> slab_activation(const std::string& model, double dx, double end_ms) {
  Scene scene;
  scene.geometry = GeometryKind::box;
  scene.cell_model = model;
  scene.activation_method = ActivationMethod::reaction_eikonal;
  scene.activation.emplace();
  const std::vector<Vector> points = {{0, 0, 0}, {0, 7, 0},  {20, 0, 0}, {20, 7, 0},    {0, 0, 3},
                                      {0, 7, 3}, {20, 0, 3}, {20, 7, 3}, {10, 3.5, 1.5}};
  for (size_t p = 0; p < points.size(); ++p) scene.activation->probes.push_back("p" + std::to_string(p + 1));
  scene.stimuli = {{"corner", Stimulus::Kind::box, ""}};
  declare_parameters(scene);
  const auto set = [&](const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  };
  const char* axes[] = {".x", ".y", ".z"};
  const double size[] = {20, 7, 3};
  for (size_t a = 0; a < 3; ++a) {
    set(std::string("geometry.box.size_mm") + axes[a], size[a]);
    for (size_t p = 0; p < points.size(); ++p)
      set("outputs.activation.probes.p" + std::to_string(p + 1) + "_mm" + axes[a], points[p][a]);
  }
  set("geometry.fibres.direction.x", 1);
  set("grid.dx_mm", dx);
  set("time.end_ms", end_ms);
  set("electrophysiology.conductivity_longitudinal_mS_per_mm", 0.1334177215);
  set("electrophysiology.conductivity_transverse_mS_per_mm", 0.01760617761);
  Member member{0, scene.parameters.values()};
  scene.parameters.resolve(member.values);
  const Plan plan = make_plan(device(), scene, {&member, 1}, {});
  Simulation simulation(device(), scene, plan);
  const auto start = std::chrono::steady_clock::now();
  const Recording recording = simulation.run({&member, 1}, 600)[0];
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  std::printf("%s, dx %.2f: %.2f s, set-up %.2f s\n", model.c_str(), dx,
              std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
              recording.setup_s);
  std::vector<double> result;
  for (size_t p = 0; p < points.size(); ++p)
    result.push_back(static_cast<double>(recording.features[recording.features.size() - points.size() + p]));
  return result;
}

TEST(ReactionEikonal, Niederer) {
  for (const char* model : {"mitchell_schaeffer", "ten_tusscher_panfilov"})
    for (const double dx : {1.0, 0.5}) {
      for (const double t : slab_activation(model, dx, 90)) std::printf(" %.2f", t);
      std::printf("\n");
    }
}

}  // namespace
}  // namespace cohort::test
