// Conduction velocities from cables, and the reaction-eikonal model on the slab of Niederer et al. 2011.
#include <chrono>
#include <cmath>
#include <cstdio>

#include "solver/conduction.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Vector = std::array<double, 3>;

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

// How wide a front must be, in cells, for the monodomain equation on a grid: what the plan decides by.
TEST(Conduction, FrontsOnGrids) {
  Conduction conduction(device(), Precision::single_);
  for (const char* name : {"mitchell_schaeffer", "ten_tusscher_panfilov"}) {
    const Cable cable = cable_of(name);
    const Front front = conduction.converged({cable})[0];
    std::printf("%s: %.4f mm/ms for 1 mm2/ms, front %.2f mm wide, latency %.2f ms\n", name, front.speed,
                front.width_mm, front.latency_ms);
    for (const double cells : {6.0, 3.0, 1.5, 0.5}) {
      const double speed = conduction.on_grid(cable, front.width_mm / cells);
      std::printf("  %.1f cells: %.4f, %+.1f %%\n", cells, speed, 100 * (speed / front.speed - 1));
      if (cells >= 1.5) EXPECT_NEAR(speed / front.speed, 1, 0.1);
      if (cells < 1) EXPECT_LT(speed / front.speed, 0.8);
    }
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

TEST(ReactionEikonal, NiedererSlabAtOneMillimetre) {
  // The monodomain equation of this program, converged: configs/niederer.yaml with grid.dx_mm 0.05
  // (time.dt_ms 0.005) and 0.025 (0.01, with substeps below that) on an H200, extrapolated with order 2. At
  // the far corner 42.82 and 42.41 ms. Uncertain by 0.2 ms across the fibres, where the order observed
  // is 1.6.
  const double converged[] = {1.22, 26.38, 31.60, 41.28, 8.24, 27.81, 32.82, 42.28, 19.54};
  constexpr double published_far_corner = 42.75, published_tolerance = 1;  // Niederer et al. 2011, converged
  const std::vector<double> activation = slab_activation("ten_tusscher_panfilov", 1, 60);
  for (size_t p = 0; p < activation.size(); ++p) {
    std::printf("p%zu: %.2f ms, converged monodomain %.2f, %+.2f\n", p + 1, activation[p], converged[p],
                activation[p] - converged[p]);
    EXPECT_NEAR(activation[p], converged[p], 1.5);
  }
  EXPECT_NEAR(activation[7], published_far_corner, 1.5 + published_tolerance);
}

}  // namespace
}  // namespace cohort::test
