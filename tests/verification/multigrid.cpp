// Convergence of the multigrid-preconditioned solver over dx on the torso, homogeneous and with tenfold jumps
// of conductivity.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/verification/lead_samples.hpp"

namespace cohort {
namespace {

struct Medium {
  const char* name;
  std::vector<std::pair<std::string, double>> ratios;  ///< of inclusions to the torso
  std::vector<double> spacings_mm;
};

struct Reduction {
  int iterations;    ///< to the tolerance
  double in_solver;  ///< average factor by which one V-cycle and its step of conjugate gradients reduce |r|
  double bare;       ///< the same for V-cycles alone, over the last of them
};

Reduction reduction(Device& device, double dx, const Medium& medium, double tolerance) {
  Scene scene;
  scene.torso = TorsoKind::cylinder;
  scene.precision = Precision::double_;  // room below 1e-8
  declare_torso(scene.parameters, scene.torso);
  scene.parameters[scene.parameters.index("torso.dx_mm")].value = dx;
  for (const auto& [name, ratio] : medium.ratios)
    scene.parameters[scene.parameters.index("torso.inclusions." + name + ".conductivity_ratio")].value =
        ratio;
  Torso torso(device, scene, 1);
  torso.set_up(scene.parameters.values());
  EllipticSolver& solver = torso.solver();
  const LeadFields& grid = torso.grid();

  // A current at the front of the chest, as of V2, into the cell that holds it.
  const Point electrode = {22, -116, 10};
  std::vector<double> source(solver.field_cells());
  const std::size_t steps[3] = {
      1, static_cast<std::size_t>(grid.extent[0]),
      static_cast<std::size_t>(grid.extent[0]) * static_cast<std::size_t>(grid.extent[1])};
  std::size_t at = 0;
  for (std::size_t i = 0; i < 3; ++i)
    at += steps[i] * static_cast<std::size_t>(std::lround((electrode[i] - grid.origin_mm[i]) / dx));
  source[at] = 1;
  const cl::Buffer b = upload(device, source, true);
  cl::Buffer x = upload(device, source, true);
  const EllipticResult result = solver.solve(b, x, tolerance, 40, 1);
  EXPECT_LT(result.relative_residual, 10 * tolerance);
  constexpr int cycles = 8, last = 4;
  const std::vector<double> bare = solver.iterate(b, x, cycles);
  return {result.iterations, std::pow(result.history.back(), -1.0 / result.iterations),
          std::pow(bare[cycles - 1] / bare[cycles - 1 - last], -1.0 / last)};
}

TEST(Multigrid, ReductionIndependentOfSpacing) {
  Device device(devices().at(0));
  const Medium media[] = {
      {"homogeneous", {}, {14, 10, 7, 5}},
      {"heart 10:1", {{"heart", 10}}, {10, 5, 2.5}},
      {"heart 1:10", {{"heart", 0.1}}, {10, 5, 2.5}},
      {"lungs 1:10, blood 3:1", {{"heart", 3}, {"left_lung", 0.1}, {"right_lung", 0.1}}, {14, 10, 7, 5}}};
  std::printf("  %-22s dx_mm  V-cycles to 1e-8  residual falls per V-cycle by  (V-cycles alone)\n", "");
  for (const Medium& medium : media) {
    int fewest = 1000, most = 0;
    for (const double dx : medium.spacings_mm) {
      const Reduction found = reduction(device, dx, medium, 1e-8);
      std::printf("  %-22s %5.2f  %16d  %28.1f  %17.1f\n", medium.name, dx, found.iterations, found.in_solver,
                  found.bare);
      std::fflush(stdout);
      EXPECT_GE(found.in_solver, 8) << medium.name << ", dx " << dx;
      EXPECT_GE(found.bare, 8) << medium.name << ", dx " << dx;
      fewest = std::min(fewest, found.iterations);
      most = std::max(most, found.iterations);
    }
    EXPECT_LE(most - fewest, 2) << medium.name;
  }
}

}  // namespace
}  // namespace cohort
