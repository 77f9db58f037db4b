// Convergence of the multigrid-preconditioned solver over dx, homogeneous and with tenfold jumps of
// conductivity.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/verification/lead_samples.hpp"

namespace cohort {
namespace {

/// Conductivity with two lungs of a tenth and a blood-filled heart of three times the torso's.
double conductivity(const Point& x) {
  const auto inside = [&](Point centre, Point half) {
    double level = 0;
    for (std::size_t i = 0; i < 3; ++i) level += std::pow((x[i] - centre[i]) / half[i], 2);
    return level < 1;
  };
  if (inside({20, -40, 0}, {45, 45, 45})) return 3;
  if (inside({80, 0, -10}, {45, 70, 110}) || inside({-80, 0, -10}, {45, 70, 110})) return 0.1;
  return 1;
}

/// Average factor by which a V-cycle within conjugate gradients reduces the residual, down to `tolerance`.
double reduction(Device& device, double dx, bool jump, double tolerance, int& iterations) {
  Scene scene;
  scene.torso = TorsoKind::cylinder;
  scene.precision = Precision::double_;  // room below 1e-8
  declare_torso(scene.parameters, scene.torso);
  scene.parameters[scene.parameters.index("torso.dx_mm")].value = dx;
  const std::vector<double> values = scene.parameters.values();
  Torso torso(device, scene);
  const LeadFields& lead = torso.fields(values);
  EllipticSolver solver(device, torso.solver().cells(), 1, true);
  const std::size_t field = solver.field_cells();
  const std::vector<double> uniform = download(device, torso.solver().conductance(), 3 * field, true);

  std::vector<double> g(3 * field), source(field), sigma(field);
  const auto row = static_cast<std::size_t>(lead.extent[0]),
             plane = row * static_cast<std::size_t>(lead.extent[1]);
  for (std::size_t c = 0; c < field; ++c) {
    const std::size_t cell[3] = {c % row, c % plane / row, c / plane};
    Point x;
    for (std::size_t i = 0; i < 3; ++i) x[i] = lead.origin_mm[i] + dx * static_cast<double>(cell[i]);
    sigma[c] = jump ? conductivity(x) : 1;
  }
  const std::size_t steps[3] = {1, row, plane};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t c = 0; c < field; ++c) {
      if (uniform[axis * field + c] == 0) continue;
      const double a = sigma[c], b = sigma[c - steps[axis]];
      g[axis * field + c] = uniform[axis * field + c] * 2 * a * b / (a + b);
    }
  // A current at the front of the chest, as of V2, into the cell that holds it.
  const Point electrode = {22, -116, 10};
  std::size_t at = 0;
  for (std::size_t i = 0; i < 3; ++i)
    at += steps[i] * static_cast<std::size_t>(std::lround((electrode[i] - lead.origin_mm[i]) / dx));
  source[at] = 1;

  device.queue().enqueueWriteBuffer(solver.conductance(), CL_TRUE, 0, 3 * field * sizeof(double), g.data());
  solver.prepare();
  const cl::Buffer b = upload(device, source, true);
  cl::Buffer x = upload(device, source, true);
  const EllipticResult result = solver.solve(b, x, tolerance, 40, 1);
  EXPECT_LT(result.relative_residual, 10 * tolerance);
  iterations = result.iterations;
  return std::pow(result.history.back(), -1.0 / result.iterations);
}

TEST(Multigrid, ReductionIndependentOfSpacing) {
  Device device(devices().at(0));
  std::printf("  dx_mm  jump  V-cycles to 1e-8  residual falls per V-cycle by\n");
  for (const bool jump : {false, true}) {
    int fewest = 1000, most = 0;
    for (const double dx : {14.0, 10.0, 7.0, 5.0}) {
      int iterations = 0;
      const double factor = reduction(device, dx, jump, 1e-8, iterations);
      std::printf("  %5.2f  %s  %16d  %.1f\n", dx, jump ? "10:1" : " 1:1", iterations, factor);
      EXPECT_GE(factor, 8) << "dx " << dx;
      fewest = std::min(fewest, iterations);
      most = std::max(most, iterations);
    }
    EXPECT_LE(most - fewest, 2);
  }
}

}  // namespace
}  // namespace cohort
