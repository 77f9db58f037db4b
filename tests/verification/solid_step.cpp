// The step that tissue may take against the true limit of central differences, 2 over the fastest frequency,
// which power iteration on differences of the forces finds from below: the step must not be beyond it. Every
// law, fibres along, across and oblique to the grid, at rest, stretched along the fibres, and with nodes at
// random places.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "solver/mechanics.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

double step_over_limit(SolidRun& run, const std::vector<double>& u) {
  const double step_ms = run.measured(u).dt_ms;
  std::vector<double> w = run.random_field(1, 7);
  double rate2 = 0;
  constexpr double small = 1e-5;
  for (int k = 0; k < 150; ++k) {
    double largest = 0;
    for (const double x : w) largest = std::max(largest, std::abs(x));
    std::vector<double> above = u, below = u, next(u.size(), 0);
    for (std::size_t i = 0; i < u.size(); ++i) {
      above[i] += small * w[i] / largest;
      below[i] -= small * w[i] / largest;
    }
    const std::vector<double> f = run.forces(above), g = run.forces(below);
    double work = 0, mass = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
      const std::size_t node = i % run.nodes();
      if (!run.is_node(node)) continue;
      const double x = w[i] / largest, y = (g[i] - f[i]) / (2 * small);
      work += x * y;
      mass += x * x * run.mass(node);
      next[i] = y / run.mass(node);
    }
    rate2 = work / mass;
    w = next;
  }
  return step_ms * std::sqrt(rate2) / 2;
}

class SolidStep : public testing::TestWithParam<std::string> {};

TEST_P(SolidStep, IsBelowTheTrueLimit) {
  const std::array<std::array<double, 3>, 3> along = {{{1, 0, 0}, {1, 1, 0}, {1, 1, 1}}};
  for (const std::array<double, 3>& direction : along)
    for (const double kappa : {100.0, 350.0}) {
      Settings set = box_size(5, 5, 5, 1);
      set.insert(set.end(), {{"geometry.fibres.direction.x", direction[0]},
                             {"geometry.fibres.direction.y", direction[1]},
                             {"geometry.fibres.direction.z", direction[2]},
                             {"mechanics.bulk_modulus_kPa", kappa}});
      SolidRun run(box_of_tissue(GetParam(), Precision::double_), set);
      const double length = std::hypot(direction[0], direction[1], direction[2]);
      const auto stretched = [&](double stretch) {
        const double across = 1 / std::sqrt(stretch);
        return run.field([&](const std::array<double, 3>& X) {
          std::array<double, 3> u{};
          double depth = 0;
          for (std::size_t k = 0; k < 3; ++k) depth += direction[k] / length * X[k];
          for (std::size_t k = 0; k < 3; ++k)
            u[k] = (stretch - across) * depth * direction[k] / length + (across - 1) * X[k];
          return u;
        });
      };
      const double rest = step_over_limit(run, run.at_rest()), longer = step_over_limit(run, stretched(1.2)),
                   shorter = step_over_limit(run, stretched(0.8)),
                   random = step_over_limit(run, run.random_field(0.1, 3));
      std::printf(
          "%-20s fibres (%g, %g, %g), kappa %3g kPa: %.3f at rest, %.3f at 1.2, %.3f at 0.8, %.3f at "
          "random\n",
          GetParam().c_str(), direction[0], direction[1], direction[2], kappa, rest, longer, shorter, random);
      EXPECT_LT(rest, 1);
      EXPECT_LT(longer, 1);
      EXPECT_LT(shorter, 1);
      EXPECT_LT(random, 1);
    }
}

INSTANTIATE_TEST_SUITE_P(All, SolidStep, testing::ValuesIn(laws()),
                         [](const testing::TestParamInfo<std::string>& law) { return law.param; });

}  // namespace
}  // namespace cohort::test
