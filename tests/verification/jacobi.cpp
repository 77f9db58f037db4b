// Jacobi's method on the deformed Laplacian, on the function and the deformation of the thesis's chapter 6
// (kernels/operators.cl).
#include "tests/verification/thesis_case.hpp"

namespace cohort::test {
namespace {

/// Poisson's equation, or with `diffusion` > 0 a step of implicit Euler, with the exact right-hand side and
/// the exact values on the rim.
struct Problem {
  ThesisGrid grid;
  Runner run;
  Operators::System system;
  std::vector<double> x, b;
  Problem(int n, bool deformed, Precision precision, double diffusion = 0)
      : grid{n, deformed}, run(precision, deformed ? Coordinates::displacement : Coordinates::reference) {
    if (diffusion > 0) system = {1, diffusion};
    x = deformed ? grid.coordinates(Coordinates::displacement) : std::vector<double>(3);
    b = grid.sample(grid.lattice, 3, [&](const Vector& p) {
      const Vector u = Exact::u(p), laplacian = Exact::laplacian(p);
      Vector right;
      for (std::size_t c = 0; c < 3; ++c)
        right[c] = system.identity * u[c] - system.diffusion_mm2 * laplacian[c];
      return right;
    });
  }
  /// 0 inside, the exact values on the rim.
  std::vector<double> start() const {
    std::vector<double> u = grid.u();
    const Lattice& l = grid.lattice;
    for (std::size_t i = 0; i < l.size(); ++i) {
      const Vector X = ThesisGrid::place(l, grid.dx, i);
      if (std::max({std::abs(X[0]), std::abs(X[1]), std::abs(X[2])}) < 1 - 0.5 * grid.dx)
        for (std::size_t c = 0; c < 3; ++c) u[c * l.size() + i] = 0;
    }
    return u;
  }
  std::vector<double> sweep(const std::vector<double>& u, const Operators::Iteration& iteration) {
    const cl::Buffer solution = run.up(u);
    run.operators.solve(grid.lattice, run.up(x), system, run.up(b), 3, iteration, solution);
    return run.down(solution, u.size());
  }
  double error(const std::vector<double>& u) const { return grid.error(grid.lattice, u, 3, Exact::u); }
  double largest_eigenvalue() { return run.operators.eigenvalues(grid.lattice, run.up(x), system).largest; }
};

struct Solution {
  double error;
  int sweeps;
};

/// Sweeps until `error` has settled to 1e-3 of itself over half as many again.
Solution solve(Problem& problem, const char* configuration) {
  Operators::Iteration iteration;
  iteration.damping = 0.95 * 2 / problem.largest_eigenvalue();
  const int n = problem.grid.n;
  std::vector<double> u = problem.start();
  int done = 0;
  double before = problem.error(u);
  for (int more = n * n / 8; done < 20 * n * n; more = done / 2) {
    iteration.sweeps = more;
    u = problem.sweep(u, iteration);
    done += more;
    const double now = problem.error(u);
    char row[200];
    std::snprintf(row, sizeof row, "jacobi at %d,%s,%s,%s,%d,%.6e", done, configuration,
                  problem.grid.deformed ? "displacement" : "none", name(problem.run.precision), n, now);
    note(row);
    if (std::abs(now - before) < 1e-3 * now) return {now, done};
    before = now;
  }
  return {before, done};
}

class Jacobi : public testing::TestWithParam<std::tuple<bool, Precision>> {};

TEST_P(Jacobi, SolutionIsOfSecondOrder) {
  const auto [deformed, precision] = GetParam();
  const char* configuration = deformed ? "deformed" : "reference";
  double before = 0;
  const int last = std::min(finest(32), 64);
  for (int n = 8; n <= last; n *= 2) {
    Problem problem(n, deformed, precision);
    const Solution solution = solve(problem, configuration);
    std::printf("%-9s %s n %3d: %5d sweeps, error %.3e  order %5.2f\n", configuration, name(precision), n,
                solution.sweeps, solution.error, before > 0 ? order(before, solution.error) : NAN);
    char row[200];
    std::snprintf(row, sizeof row, "jacobi,%s,%s,%s,%d,%.6e", configuration,
                  deformed ? "displacement" : "none", name(precision), n, solution.error);
    note(row);
    if (n >= 32) {
      EXPECT_GE(order(before, solution.error), 1.9);
    }
    before = solution.error;
  }
}
std::string title(const testing::TestParamInfo<Jacobi::ParamType>& test) {
  return std::string(std::get<0>(test.param) ? "deformed_" : "reference_") + name(std::get<1>(test.param));
}
INSTANTIATE_TEST_SUITE_P(Thesis, Jacobi,
                         testing::Combine(testing::Bool(),
                                          testing::Values(Precision::single_, Precision::double_)),
                         title);

// D^-1 A of the undeformed grid has eigenvalues up to 8/3: waves along one axis, 4 / dx^2, over a diagonal of
// 3 / (2 dx^2). So Jacobi's method without damping does not converge in three dimensions; the limit is 3/4.
// With u = 0 on the rim of n cells the fastest wave is a half-wave longer.
TEST(Damping, MustStayBelowThreeQuarters) {
  constexpr int n = 16;
  const double c = std::pow(std::cos(std::numbers::pi / (2 * n)), 2), s = 1 - c;
  const double expected = 8.0 / 3 * (c * c * c + 2 * s * s * c);
  Problem problem(n, false, Precision::double_);
  const double largest = problem.largest_eigenvalue();
  std::printf("largest eigenvalue of D^-1 A: reference %.4f, expected %.4f", largest, expected);
  EXPECT_NEAR(largest, expected, 0.002);
  for (int m = n; m <= std::min(finest(32), 128); m *= 2) {
    const double deformed = Problem(m, true, Precision::double_).largest_eigenvalue();
    std::printf(", deformed at n %d %.4f", m, deformed);
    EXPECT_GT(deformed, expected);
  }
  std::printf("\n");
  // Of a field that should go to nil.
  std::fill(problem.b.begin(), problem.b.end(), 0.0);
  std::vector<double> u = problem.start();
  for (std::size_t i = 0; i < problem.grid.lattice.size(); ++i) {
    const Vector X = ThesisGrid::place(problem.grid.lattice, problem.grid.dx, i);
    const bool inside = std::max({std::abs(X[0]), std::abs(X[1]), std::abs(X[2])}) < 0.99;
    for (std::size_t k = 0; k < 3; ++k)
      u[k * problem.grid.lattice.size() + i] = inside ? std::sin(double(i * (k + 2))) : 0;
  }
  const auto growth = [&](double damping) {
    const auto size = [](const std::vector<double>& v) {
      double sum = 0;
      for (const double value : v) sum += value * value;
      return std::sqrt(sum);
    };
    const std::vector<double> before = problem.sweep(u, {damping, 100, true});
    return size(problem.sweep(before, {damping, 20, true})) / size(before);
  };
  const double limit = 2 / expected;
  std::printf("20 sweeps multiply by %.2e undamped, %.3f above the limit of %.3f, %.3f below it\n", growth(1),
              growth(1.02 * limit), limit, growth(0.98 * limit));
  EXPECT_NEAR(growth(1), std::pow(expected - 1, 20), 0.02 * growth(1));
  EXPECT_GT(growth(1.02 * limit), 1.5);
  EXPECT_LT(growth(0.98 * limit), 1);
}

TEST(Jacobi, AssemblesTheSameRowsInEverySweep) {
  for (const Precision precision : {Precision::single_, Precision::double_}) {
    Problem problem(12, true, precision);
    const std::vector<double> u = problem.start();
    Operators::Iteration stored{0.5, 7, true}, in_every_sweep{0.5, 7, false};
    EXPECT_EQ(problem.sweep(u, stored), problem.sweep(u, in_every_sweep)) << name(precision);
  }
}

// A member knows nothing of its neighbours.
TEST(Jacobi, GivesTheSameBitsInAnyBatch) {
  Problem one(10, true, Precision::single_), other(10, false, Precision::single_);
  const Lattice& l = one.grid.lattice;
  Runner batch(Precision::single_, Coordinates::displacement, 2);
  const auto join = [](std::vector<double> a, const std::vector<double>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  const std::vector<double> flat(3 * l.size(), 0.0);
  const Operators::Iteration iteration{0.5, 20, true};
  const cl::Buffer solution = batch.up(join(other.start(), one.start()));
  batch.operators.solve(l, batch.up(join(flat, one.x)), one.system, batch.up(join(other.b, one.b)), 3,
                        iteration, solution);
  const std::vector<double> both = batch.down(solution, 6 * l.size());
  EXPECT_EQ(std::vector<double>(both.begin() + static_cast<std::ptrdiff_t>(3 * l.size()), both.end()),
            one.sweep(one.start(), iteration));
}

// (I - nu dt Laplacian) u = b is dominated by its diagonal: few sweeps, second order.
TEST(ImplicitEuler, TakesFewSweeps) {
  constexpr double nu_dt_mm2 = 2.5e-4;
  double before = 0;
  for (const int n : {32, 64}) {
    Problem problem(n, true, Precision::double_, nu_dt_mm2);
    Operators::Iteration iteration;
    iteration.sweeps = n;
    const std::vector<double> u = problem.sweep(problem.start(), iteration);
    const double after = problem.error(u), settled = problem.error(problem.sweep(u, iteration));
    std::printf("n %d: error after %d sweeps %.3e, after as many again %.3e  order %.2f\n", n, n, after,
                settled, before > 0 ? order(before, settled) : NAN);
    EXPECT_NEAR(after / settled, 1, 0.01);
    if (before > 0) {
      EXPECT_GE(order(before, settled), 1.9);
    }
    before = settled;
  }
}

}  // namespace
}  // namespace cohort::test
