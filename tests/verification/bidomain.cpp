// Exact solutions of the bidomain equations: Pathmanathan & Gray's with and without a bath, and oblique, unequal
// anisotropy against a potential made for it.
#include "solver/bidomain.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using std::numbers::pi;

struct Errors {
  double V, phi;  // L2
};

// Root mean squares over cells; of phi less its mean.
double norm(const std::vector<double>& error, bool less_mean) {
  double mean = 0, sum = 0;
  for (const double e : error) mean += e / static_cast<double>(error.size());
  for (const double e : error) sum += less_mean ? (e - mean) * (e - mean) : e * e;
  return std::sqrt(sum / static_cast<double>(error.size()));
}

// A slab with the bidomain solver on it.
struct Conductor {
  Conductor(Slab& slab_)
      : slab(slab_), bidomain(*slab.launcher, slab.scene, slab.definitions, slab.grid, 1) {
    bidomain.assemble(*slab.tissue, *slab.diffusion, *slab.monodomain, slab.parameters,
                      std::span<const Member>(&slab.member, 1));
  }
  // Couplings of constant tensors xx yy zz xy xz yz over dx^2 on the cells of `cells`.
  cl::Buffer tensors(const Tissue& cells, const std::function<std::array<double, 6>(std::size_t)>& tensor) {
    const auto stride = static_cast<std::size_t>(cells.stride);
    std::vector<double> values(6 * stride, 0.0);
    for (std::size_t i = 0; i < stride; ++i) {
      if (cells.regions[i] == 255) continue;
      const std::array<double, 6> of_cell = tensor(i);
      for (std::size_t c = 0; c < 6; ++c) values[c * stride + i] = of_cell[c];
    }
    const cl::Buffer buffer = device().allocate(values.size() * sizeof(double));
    slab.write(buffer, values);
    return buffer;
  }

  Slab& slab;
  Bidomain bidomain;
};

constexpr double chi = 3, Cm = 2, k = 1 / std::numbers::sqrt2;

// States at t = 0 of the exact solution V = sqrt(1+t) F + `shift`, then steps to t = 1.
template <typename F, typename G, typename Shift>
std::vector<double> run_to_1(Slab& slab, Bidomain& bidomain, double dt, const F& f, const G& g,
                             const Shift& shift) {
  const auto stride = static_cast<size_t>(slab.tissue->stride);
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  bidomain.initialise();
  slab.write(slab.monodomain->potential(), slab.field([&](auto... p) { return f(p...) + shift(p...); }));
  slab.write(slab.monodomain->states(),
             slab.field([&](auto... p) { return g(p...) + f(p...) + shift(p...); }, 1));
  slab.write(slab.monodomain->states(), slab.field([&](auto... p) { return 1 / std::sqrt(g(p...)); }, 1),
             stride);
  const auto steps = static_cast<int>(std::lround(1 / dt));
  for (int step = 0; step < steps; ++step)
    bidomain.advance(*slab.tissue, *slab.monodomain, slab.parameters, step * dt, step == 0);
  return slab.read(bidomain.closed_potential(*slab.tissue, *slab.monodomain, 1), stride);
}

Errors pathmanathan_gray(int dimensions, double N, double& iterations) {
  const double h = 0.1 * N, dt = 0.1 * N * N;
  const double betas[] = {-1.1, -5.9, -8.6}, sigma[] = {1.1 / (pi * pi), 1.2 / (pi * pi), 0.3 / (pi * pi)};
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
             {"electrophysiology.elliptic_tolerance", 1e-7},
             {"electrophysiology.pathmanathan_gray.beta", betas[dimensions - 1] * (1 - k)},
             {"electrophysiology.pathmanathan_gray.chi_times_capacitance", chi * Cm}},
            {}, ActivationMethod::bidomain);
  Conductor conductor(slab);
  Bidomain& bidomain = conductor.bidomain;
  const auto tensor = [&](double factor) {
    return [=](std::size_t) {
      const double scale = factor / (chi * Cm * h * h);
      return std::array<double, 6>{sigma[0] * scale, sigma[1] * scale, sigma[2] * scale, 0, 0, 0};
    };
  };
  slab.diffusion->assemble_tensors(*slab.tissue, conductor.tensors(*slab.tissue, tensor(1)),
                                   Diffusion::Use::monodomain, slab.monodomain->stencil());
  slab.diffusion->assemble_tensors(bidomain.conductor(),
                                   conductor.tensors(bidomain.conductor(), tensor((1 - k) / k)),
                                   Diffusion::Use::layered, bidomain.conductor_stencil());
  bidomain.build_operators(*slab.tissue, slab.monodomain->stencil());

  const auto none = [](double, double, double) { return 0.0; };
  const std::vector<double> V = run_to_1(slab, bidomain, dt, F, G, none);
  iterations = static_cast<double>(bidomain.iterations()) / static_cast<double>(bidomain.solves());
  const cl::Buffer closed = device().allocate(V.size() * sizeof(double));
  slab.write(closed, V);
  const std::vector<double> phi =
      slab.read(bidomain.extracellular(*slab.tissue, *slab.monodomain, closed, 1), V.size());
  std::vector<double> of_V, of_phi;
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const double exact = std::numbers::sqrt2 * F(p[0], p[1], p[2]);
    of_V.push_back(V[i] - exact);
    of_phi.push_back(phi[i] + k * exact);
  });
  EXPECT_LE(bidomain.worst_residual()[0], 1e-7);
  return {norm(of_V, false), norm(of_phi, true)};
}

void expect_second_order(const std::string& name, const std::vector<Errors>& errors,
                         const std::vector<double>& refinements) {
  for (std::size_t n = 0; n < errors.size(); ++n) {
    std::printf("%s  N 1/%g  error V %.3e  phi_e %.3e", name.c_str(), refinements[n], errors[n].V,
                errors[n].phi);
    if (n > 0) {
      const double ratio = std::log(refinements[n] / refinements[n - 1]);
      std::printf("  order %.2f %.2f", std::log(errors[n - 1].V / errors[n].V) / ratio,
                  std::log(errors[n - 1].phi / errors[n].phi) / ratio);
    }
    std::printf("\n");
  }
  const std::size_t last = errors.size() - 1;
  const double ratio = std::log(refinements[last] / refinements[last - 1]);
  EXPECT_GE(std::log(errors[last - 1].V / errors[last].V) / ratio, 1.9) << name;
  EXPECT_GE(std::log(errors[last - 1].phi / errors[last].phi) / ratio, 1.9) << name;
}

class PathmanathanGrayBidomain : public testing::TestWithParam<int> {};

TEST_P(PathmanathanGrayBidomain, ConvergesWithSecondOrder) {
  const int dimensions = GetParam();
  std::vector<double> refinements = {1, 2, 4};
  if (dimensions < 3) refinements.push_back(8);
  std::vector<Errors> errors;
  for (const double refinement : refinements) {
    double iterations = 0;
    errors.push_back(pathmanathan_gray(dimensions, 1 / refinement, iterations));
    std::printf("%d D  N 1/%g  V-cycles a step %.2f\n", dimensions, refinement, iterations);
  }
  expect_second_order(std::to_string(dimensions) + " D", errors, refinements);
}
INSTANTIATE_TEST_SUITE_P(Dimensions, PathmanathanGrayBidomain, testing::Values(1, 2, 3));

}  // namespace
}  // namespace cohort::test
