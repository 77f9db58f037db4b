// Exact solutions of the monodomain equation: the front of a frozen gate, and Pathmanathan & Gray's.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using std::numbers::pi;

// With the gate frozen at h = 1, dv/dt = D v'' - (1/tau_in) v (v - a)(v - b) with a < b the roots of
// v^2 - v + tau_in / tau_out. Its front moves at c = sqrt(D / (2 tau_in)) (b - 2 a)  (Murray, Mathematical
// Biology I, section 13.4, scaled to the root b).
TEST(FrozenGate, FrontMovesAtTheSpeedOfTheCubic) {
  constexpr double tau_in = 0.3, tau_out = 6, D = 0.1, dx = 0.1;
  const double root = std::sqrt(1 - 4 * tau_in / tau_out), a = (1 - root) / 2, b = (1 + root) / 2;
  const double exact = std::sqrt(D / (2 * tau_in)) * (b - 2 * a);
  constexpr double length = 24;
  const std::string ms = "electrophysiology.mitchell_schaeffer.";
  Slab slab({length, dx, dx}, dx, Precision::double_, "mitchell_schaeffer",
            {{"electrophysiology.conductivity_longitudinal_mS_per_mm", D * 1.4},
             {"electrophysiology.conductivity_transverse_mS_per_mm", D * 1.4},
             {ms + "tau_open_ms", 1e12},
             {ms + "tau_close_ms", 1e12},
             {ms + "resting_mV", 0},
             {ms + "amplitude_mV", 1}});
  constexpr double dt = 0.01;
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  slab.write(slab.monodomain->potential(),
             slab.field([&](double x, double, double) { return x < 2 ? b : 0; }));

  // Place of the front: where v falls through one half, linear between centres.
  const auto front = [&] {
    const std::vector<double> v = slab.potential();
    double place = 0, previous_x = 0, previous = 1;
    slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
      if (previous >= 0.5 && v[i] < 0.5)
        place = previous_x + (previous - 0.5) / (previous - v[i]) * (p[0] - previous_x);
      previous = v[i];
      previous_x = p[0];
    });
    return place;
  };
  const auto run = [&](int first, int last) {
    for (int step = first; step < last; ++step)
      slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == 0);
  };
  run(0, 1500);
  const double start = front();
  run(1500, 4500);
  const double speed = (front() - start) / (3000 * dt);
  std::printf("front speed %.5f mm/ms, exact %.5f, error %.3f %%\n", speed, exact, 100 * (speed / exact - 1));
  EXPECT_NEAR(speed / exact, 1.0, 0.003);
}

class PathmanathanGray : public testing::TestWithParam<int> {};

// A solution at t = 1 on the unit line, square or cube.
struct Solution {
  std::vector<double> V, error;  // tissue cells, in the order of the fields
  double rms_error() const {
    return std::sqrt(std::inner_product(error.begin(), error.end(), error.begin(), 0.0) /
                     static_cast<double>(error.size()));
  }
};
Solution pathmanathan_gray(int dimensions, double h, double dt) {
  const double betas[] = {-1.1, -5.9, -8.6}, sigma[] = {1.1 / (pi * pi), 1.2 / (pi * pi), 0.3 / (pi * pi)};
  constexpr double chi = 3, Cm = 2;
  const auto F = [&](double x, double y, double z) {
    return std::cos(pi * x) * (dimensions > 1 ? std::cos(2 * pi * y) : 1) *
           (dimensions > 2 ? std::cos(3 * pi * z) : 1);
  };
  const auto G = [&](double x, double y, double z) {
    return 1 + x * (dimensions > 1 ? y * y : 1) * (dimensions > 2 ? z * z * z : 1);
  };
  Slab slab({1, dimensions > 1 ? 1 : h, dimensions > 2 ? 1 : h}, h, Precision::double_, "pathmanathan_gray",
            {{"electrophysiology.surface_to_volume_per_mm", chi},
             {"electrophysiology.capacitance_uF_per_mm2", Cm},
             {"electrophysiology.pathmanathan_gray.beta", betas[dimensions - 1]},
             {"electrophysiology.pathmanathan_gray.chi_times_capacitance", chi * Cm}});
  const auto stride = static_cast<size_t>(slab.tissue->stride);
  std::vector<double> tensors(6 * stride, 0.0);
  for (size_t a = 0; a < 3; ++a)
    slab.each_cell(
        [&](std::size_t i, const auto&) { tensors[a * stride + i] = sigma[a] / (chi * Cm * h * h); });
  const cl::Buffer tensor_buffer = device().allocate(tensors.size() * sizeof(double));
  slab.write(tensor_buffer, tensors);
  slab.diffusion->assemble_tensors(*slab.tissue, tensor_buffer, Diffusion::Use::monodomain,
                                   slab.monodomain->stencil());

  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  slab.write(slab.monodomain->potential(), slab.field(F));
  slab.write(slab.monodomain->states(), slab.field([&](auto... p) { return G(p...) + F(p...); }, 1));
  slab.write(slab.monodomain->states(), slab.field([&](auto... p) { return 1 / std::sqrt(G(p...)); }, 1),
             stride);
  const auto steps = static_cast<int>(std::lround(1 / dt));
  for (int step = 0; step < steps; ++step)
    slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == 0);
  const std::vector<double> V = slab.read(slab.monodomain->closed_potential(*slab.tissue), stride);
  const double V1 = std::sqrt(2.0);
  Solution solution;
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    solution.V.push_back(V[i]);
    solution.error.push_back(V[i] - V1 * F(p[0], p[1], p[2]));
  });
  return solution;
}

TEST_P(PathmanathanGray, ConvergesWithSecondOrder) {
  const int dimensions = GetParam();
  std::vector<double> errors;
  for (const double N : {1.0, 0.5, 0.25, 0.125})
    errors.push_back(pathmanathan_gray(dimensions, 0.1 * N, 0.1 * N * N).rms_error());
  for (size_t k = 0; k < errors.size(); ++k)
    std::printf("%d D  N 1/%d  error %.3e  order %.2f\n", dimensions, 1 << k, errors[k],
                k > 0 ? std::log2(errors[k - 1] / errors[k]) : 0.0);
  EXPECT_GE(std::log2(errors[errors.size() - 2] / errors.back()), 1.9);
  EXPECT_LT(errors.back(), 2e-3);
}

// Steps halved on one grid: what is left between two runs is the error in time.
TEST(Splitting, IsOfSecondOrderInTime) {
  std::vector<Solution> solutions;
  for (const double dt : {0.04, 0.02, 0.01, 0.005}) solutions.push_back(pathmanathan_gray(1, 0.05, dt));
  std::vector<double> differences;
  for (size_t k = 1; k < solutions.size(); ++k) {
    double sum = 0;
    for (size_t i = 0; i < solutions[k].V.size(); ++i)
      sum += std::pow(solutions[k].V[i] - solutions[k - 1].V[i], 2);
    differences.push_back(std::sqrt(sum));
    std::printf("dt %.3f ms  difference %.3e  order %.2f\n", 0.04 / (1 << k), differences.back(),
                k > 1 ? std::log2(differences[k - 2] / differences[k - 1]) : 0.0);
  }
  EXPECT_GE(std::log2(differences[1] / differences[2]), 1.9);
}

INSTANTIATE_TEST_SUITE_P(Dimensions, PathmanathanGray, testing::Values(1, 2, 3));

}  // namespace
}  // namespace cohort::test
