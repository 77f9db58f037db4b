// Where the floor of single precision comes from, by experiment: the operators on inputs and in arithmetic of
// either precision, against double precision throughout (tests/results/operators.md tells the story).
#include "tests/verification/thesis_case.hpp"

namespace cohort::test {
namespace {

enum class Operator { interpolation, gradient, divergence, laplacian };
constexpr Operator all_operators[] = {Operator::interpolation, Operator::gradient, Operator::divergence,
                                      Operator::laplacian};
const char* name(Operator which) {
  constexpr const char* names[] = {"interpolation", "gradient", "divergence", "laplacian"};
  return names[static_cast<int>(which)];
}

struct Experiment {
  bool single_arithmetic = false, single_u = false, single_x = false;
  Coordinates kind = Coordinates::position;
  double shift_mm = 0;  ///< of the whole domain
  double unit = 1;      ///< all lengths times this
};
constexpr Experiment all_single = {true, true, true};

std::vector<double> rounded(std::vector<double> numbers) {
  for (double& number : numbers) number = static_cast<double>(static_cast<float>(number));
  return numbers;
}

std::vector<double> apply(Operator which, const ThesisGrid& grid, const Experiment& how) {
  Lattice lattice = grid.lattice;
  lattice.dx_mm *= how.unit;
  std::vector<double> u = grid.u(), x = grid.coordinates(how.kind);
  for (double& value : x) value = (value + (how.kind == Coordinates::position ? how.shift_mm : 0)) * how.unit;
  if (how.single_u) u = rounded(u);
  if (how.single_x) x = rounded(x);
  Runner run(how.single_arithmetic ? Precision::single_ : Precision::double_, how.kind);
  std::vector<double> result = which == Operator::interpolation ? run.interpolate(lattice, u, 3)
                               : which == Operator::gradient    ? run.gradient(lattice, x, u, 3)
                               : which == Operator::divergence  ? run.divergence(lattice, x, u, 1)
                                                                : run.laplacian(lattice, x, u, 3);
  const double scale = which == Operator::interpolation ? 1
                       : which == Operator::laplacian   ? how.unit * how.unit
                                                        : how.unit;
  for (double& value : result) value *= scale;
  return result;
}

/// L2 norm of what rounding does, over the reference volume.
double rounding(Operator which, const ThesisGrid& grid, const Experiment& how) {
  const std::vector<double> exact = apply(which, grid, {}), got = apply(which, grid, how);
  double sum = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) sum += std::pow(got[i] - exact[i], 2);
  return std::sqrt(sum * std::pow(grid.dx, 3));
}

// A number of size 1 is off by 6e-8 at most. A difference quotient divides that by dx, a second one once
// more. Spacings that are no fractions of a power of two, at which all places would be exact.
TEST(Floor, GrowsWithEachDifferenceQuotient) {
  constexpr int coarse = 24, fine = 96;
  const int powers[] = {0, 1, 1, 2};
  for (const bool deformed : {false, true})
    for (const Operator which : all_operators) {
      std::printf("%-9s %-13s", deformed ? "deformed" : "reference", name(which));
      double off[2] = {};
      for (int n = coarse; n <= fine; n *= 2) {
        const double now = rounding(which, {n, deformed}, all_single);
        std::printf("  n %3d rounding %.2e", n, now);
        if (n == coarse) off[0] = now;
        off[1] = now;
      }
      const double power = std::log2(off[1] / off[0]) / std::log2(double(fine) / coarse);
      std::printf("  as dx^-%.2f\n", power);
      EXPECT_NEAR(power, powers[static_cast<int>(which)], 0.25) << name(which);
    }
}

// At 128 cells an edge the Laplacian's rounding is larger than the scheme's own error; in double precision
// there is nothing of it.
TEST(Floor, EndsTheOrderOfTheLaplacianInSinglePrecisionAlone) {
  double error[2][2];
  for (const Precision precision : {Precision::single_, Precision::double_})
    for (const int n : {64, 128}) {
      const ThesisGrid grid{n, false, 1};
      Runner run(precision, Coordinates::position);
      error[precision == Precision::double_][n == 128] = grid.error(
          grid.lattice, run.laplacian(grid.lattice, grid.positions(), grid.u(), 3), 3, Exact::laplacian);
    }
  std::printf("Laplacian from 64 to 128: single %.3e %.3e, double %.3e %.3e\n", error[0][0], error[0][1],
              error[1][0], error[1][1]);
  EXPECT_LT(order(error[0][0], error[0][1]), 1.5);
  EXPECT_GT(error[0][1], 1.5 * error[1][1]);
  EXPECT_NEAR(order(error[1][0], error[1][1]), 2, 0.05);
}

// The floor of the stored numbers, whatever computes with them.
TEST(Floor, ComesFromTheStoredNumbersNotFromTheArithmetic) {
  const ThesisGrid grid{64, true};
  for (const Operator which : {Operator::gradient, Operator::divergence, Operator::laplacian}) {
    const double u = rounding(which, grid, {false, true, false}),
                 x = rounding(which, grid, {false, false, true}),
                 both = rounding(which, grid, {false, true, true}), all = rounding(which, grid, all_single),
                 reference = rounding(which, {64, false}, all_single);
    std::printf(
        "%-10s double on single u %.2e, on single x %.2e, on both %.2e; single throughout %.2e (reference "
        "%.2e)\n",
        name(which), u, x, both, all, reference);
    char row[200];
    std::snprintf(row, sizeof row, "rounding,%s,%.3e,%.3e,%.3e,%.3e", name(which), u, x, both, all);
    note(row);
    EXPECT_GT(both, 0.9 * all) << name(which);
    EXPECT_NEAR(both / std::hypot(u, x), 1, 0.1) << "the two are independent";
  }
}

// The operators are linear: with what the first float of each number has lost in a second one, and all
// arithmetic in single precision, most of the floor is gone.
TEST(Floor, IsLiftedByASecondFloatOfEachNumber) {
  const ThesisGrid grid{64, false};
  const Lattice& l = grid.lattice;
  const std::vector<double> u = grid.u(), first = rounded(u), none(3);
  std::vector<double> second(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) second[i] = u[i] - first[i];
  Runner single(Precision::single_, Coordinates::reference),
      exact(Precision::double_, Coordinates::reference);
  for (const Operator which : {Operator::gradient, Operator::divergence, Operator::laplacian}) {
    const auto run = [&](Runner& runner, const std::vector<double>& field) {
      return which == Operator::gradient     ? runner.gradient(l, none, field, 3)
             : which == Operator::divergence ? runner.divergence(l, none, field, 1)
                                             : runner.laplacian(l, none, field, 3);
    };
    const std::vector<double> right = run(exact, u), one = run(single, first), two = run(single, second);
    double alone = 0, both = 0;
    for (std::size_t i = 0; i < right.size(); ++i) {
      alone += std::pow(one[i] - right[i], 2);
      both += std::pow(one[i] + two[i] - right[i], 2);
    }
    alone = std::sqrt(alone * std::pow(grid.dx, 3));
    both = std::sqrt(both * std::pow(grid.dx, 3));
    std::printf("%-10s rounding with u in one float %.2e, in two %.2e\n", name(which), alone, both);
    char row[200];
    std::snprintf(row, sizeof row, "pairs,%s,%.2e,%.2e", name(which), alone, both);
    note(row);
    EXPECT_LT(both, 0.1 * alone) << name(which);
  }
}

// The thesis blames J ~ dx^3 for tending to machine zero and advises to choose units. A float keeps 24 bits
// at any size: units change nothing, and powers of two not a bit.
TEST(Floor, DoesNotDependOnUnits) {
  const ThesisGrid grid{32, true};
  for (const Operator which : {Operator::gradient, Operator::divergence, Operator::laplacian}) {
    const std::vector<double> mm = apply(which, grid, all_single);
    for (const double unit : {std::ldexp(1.0, -20), std::ldexp(1.0, 20)}) {
      Experiment scaled = all_single;
      scaled.unit = unit;
      EXPECT_EQ(apply(which, grid, scaled), mm) << name(which) << " with lengths times " << unit;
    }
    Experiment metres = all_single;
    metres.unit = 1e-3;
    const double ratio = rounding(which, grid, metres) / rounding(which, grid, all_single);
    std::printf("%-10s in m instead of mm: %.3f of the rounding\n", name(which), ratio);
    // The distance between floats of a size varies by two, so may rounding.
    EXPECT_GT(ratio, 0.5);
    EXPECT_LT(ratio, 2);
  }
}

// What helps is smaller numbers: displacements do not know how far the heart lies from the origin.
TEST(Floor, OfDisplacementsDoesNotDependOnThePlace) {
  const ThesisGrid grid{32, true};
  for (const Operator which : {Operator::gradient, Operator::divergence, Operator::laplacian}) {
    Experiment x = {false, false, true}, far = x, displacement = x, far_displacement = x;
    far.shift_mm = far_displacement.shift_mm = 100;
    displacement.kind = far_displacement.kind = Coordinates::displacement;
    const double here = rounding(which, grid, x), there = rounding(which, grid, far),
                 moved = rounding(which, grid, displacement);
    std::printf("%-10s rounding by coordinates: position %.2e, 100 mm away %.2e, displacement %.2e\n",
                name(which), here, there, moved);
    char row[200];
    std::snprintf(row, sizeof row, "place,%s,%.3e,%.3e,%.3e", name(which), here, there, moved);
    note(row);
    EXPECT_GT(there, 20 * here);
    EXPECT_LT(moved, here);
    EXPECT_EQ(rounding(which, grid, far_displacement), moved);
  }
}

}  // namespace
}  // namespace cohort::test
