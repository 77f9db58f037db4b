// The deforming tissue at single motions: forces, energies, volumes, the element's modes. solver/README.md,
// "Decisions".
#include <fstream>
#include <numeric>

#include "solver/mechanics.hpp"
#include "tests/laws.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

struct LawCase {
  std::string law;
  Precision precision;
};
std::ostream& operator<<(std::ostream& stream, const LawCase& c) {
  return stream << c.law;
}
std::vector<LawCase> law_cases() {
  std::vector<LawCase> cases;
  for (const std::string& law : laws())
    for (const Precision precision : {Precision::double_, Precision::single_})
      cases.push_back({law, precision});
  return cases;
}
bool is_double(const LawCase& c) {
  return c.precision == Precision::double_;
}

class SolidLaws : public testing::TestWithParam<LawCase> {};
class SolidEnergies : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, SolidEnergies, testing::ValuesIn(laws()),
                         [](const auto& test) { return test.param; });
INSTANTIATE_TEST_SUITE_P(All, SolidLaws, testing::ValuesIn(law_cases()), [](const auto& test) {
  return test.param.law + (is_double(test.param) ? "_double" : "_single");
});

// An affine displacement is the same stress everywhere: nothing pulls at a node within the tissue. The box
// ends in cut cells; what they do to the nodes around full cells must vanish too, and all forces together.
TEST_P(SolidLaws, AffineDisplacementLeavesInnerNodesAtRest) {
  SolidRun run(box_of_tissue(GetParam().law, GetParam().precision), box_size(5.7, 4.3, 4.6, 1));
  const Matrix G = {{{0.08, 0.05, -0.03}, {-0.04, -0.06, 0.07}, {0.02, 0.03, 0.05}}};
  const std::vector<double> f = run.forces(run.field([&](const Vector& X) { return times(G, X); }));
  double inner = 0;
  int inner_nodes = 0;
  std::array<double, 3> total{};
  for (std::size_t a = 0; a < run.nodes(); ++a)
    for (std::size_t k = 0; k < 3; ++k) {
      total[k] += f[k * run.nodes() + a];
      if (!run.is_node(a) || !run.within_tissue(a)) continue;
      inner = std::max(inner, std::abs(f[k * run.nodes() + a]));
      inner_nodes += k == 0;
    }
  const double largest_force = largest_of(f), rounding = is_double(GetParam()) ? 2e-14 : 5e-6;
  std::printf("%s, %s: affine motion, force on inner nodes over the largest %.1e, of all together %.1e\n",
              GetParam().law.c_str(), is_double(GetParam()) ? "double" : "single", inner / largest_force,
              std::hypot(total[0], total[1], total[2]) / largest_force);
  EXPECT_EQ(inner_nodes, 4 * 3 * 3);
  EXPECT_GT(largest_force, 0.5);
  EXPECT_LT(inner / largest_force, rounding);
  for (const double sum : total) EXPECT_LT(std::abs(sum) / largest_force, 10 * rounding);
}

// Translation and rotation store nothing and pull at nothing.
TEST_P(SolidLaws, RigidMotionGivesNoForce) {
  SolidRun run(box_of_tissue(GetParam().law, GetParam().precision), box_size(5.7, 4.3, 4.6, 1));
  // The force of a stretch of 1 % is what there is to compare with.
  const double scale = largest_of(run.forces(run.field([](const Vector& X) {
    return Vector{0.01 * X[0], 0, 0};
  })));
  const double rounding = is_double(GetParam()) ? 1e-12 : 3e-4;
  EXPECT_LT(largest_of(run.forces(run.field([](const Vector&) {
              return Vector{3, -7, 11};
            }))),
            rounding * scale);
  std::mt19937_64 random(7);
  for (int i = 0; i < 3; ++i) {
    Matrix R = random_rotation(random);
    for (std::size_t k = 0; k < 3; ++k) R[k][k] -= 1;
    const std::vector<double> u = run.field([&](const Vector& X) { return times(R, X); });
    ASSERT_GT(largest_of(u), 3);
    const double largest_force = largest_of(run.forces(u));
    std::printf("%s, %s: rotation, force over that of a stretch of 1 %% %.1e\n", GetParam().law.c_str(),
                is_double(GetParam()) ? "double" : "single", largest_force / scale);
    EXPECT_LT(largest_force, rounding * scale);
    if (is_double(GetParam())) {
      EXPECT_LT(std::abs(run.measured(u).energy_uJ), 1e-9);
    }
  }
}

// Forces are those of the energy that solid_measure sums.
TEST_P(SolidEnergies, ForcesAreTheirSlope) {
  SolidRun run(box_of_tissue(GetParam(), Precision::double_), box_size(5.7, 4.3, 4.6, 1));
  for (const unsigned seed : {1u, 2u, 3u}) {
    const std::vector<double> u = run.random_field(0.12, seed), w = run.random_field(1, seed + 100);
    const double expected = -dot(run.forces(u), w), step = 1e-6;
    const auto energy = [&](double along) {
      std::vector<double> moved = u;
      for (std::size_t i = 0; i < u.size(); ++i) moved[i] += along * w[i];
      return run.measured(moved).energy_uJ;
    };
    const double found = (energy(step) - energy(-step)) / (2 * step);
    EXPECT_GT(std::abs(expected), 1);
    EXPECT_NEAR(found / expected, 1, 1e-8) << expected;
  }
}

/// Eigenvalues of a symmetric matrix (n, n), smallest first: cyclic Jacobi.
std::vector<double> eigenvalues(std::vector<double> A, std::size_t n) {
  for (int sweep = 0; sweep < 60; ++sweep)
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        if (std::abs(A[p * n + q]) < 1e-300) continue;
        const double angle = 0.5 * std::atan2(2 * A[p * n + q], A[p * n + p] - A[q * n + q]);
        const double c = std::cos(angle), s = std::sin(angle);
        for (std::size_t k = 0; k < n; ++k) {
          const double a = A[k * n + p], b = A[k * n + q];
          A[k * n + p] = c * a + s * b;
          A[k * n + q] = c * b - s * a;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double a = A[p * n + k], b = A[q * n + k];
          A[p * n + k] = c * a + s * b;
          A[q * n + k] = c * b - s * a;
        }
      }
  std::vector<double> result(n);
  for (std::size_t k = 0; k < n; ++k) result[k] = A[k * n + k];
  std::sort(result.begin(), result.end());
  return result;
}

/// Eigenvalues (kPa mm) of the stiffness at rest of a single cell of 1 mm with this box of tissue in it.
std::vector<double> modes_of_cell(const std::string& law, double x, double y, double z,
                                  std::array<double, 4>* quarters) {
  SolidRun run(box_of_tissue(law, Precision::double_), box_size(x, y, z, 1));
  EXPECT_EQ(run.mesh().tissue_cells[0], 1);
  std::vector<std::size_t> corners;
  for (std::size_t a = 0; a < run.nodes(); ++a)
    if (run.is_node(a)) corners.push_back(a);
  EXPECT_EQ(corners.size(), 8u);
  const std::size_t cell = run.cells_of(corners[0]).at(0);
  for (std::size_t g = 0; g < 4; ++g) (*quarters)[g] = run.quarter(cell, g);
  constexpr std::size_t n = 24;
  constexpr double step = 1e-5;
  std::vector<double> K(n * n);
  for (std::size_t j = 0; j < n; ++j) {
    std::vector<double> f[2];
    for (int side = 0; side < 2; ++side) {
      std::vector<double> u = run.at_rest();
      u[j / 8 * run.nodes() + corners[j % 8]] = side ? step : -step;
      f[side] = run.forces(u);
    }
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t at = i / 8 * run.nodes() + corners[i % 8];
      K[i * n + j] = (f[0][at] - f[1][at]) / (2 * step);
    }
  }
  double apart = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      apart = std::max(apart, std::abs(K[i * n + j] - K[j * n + i]));
      K[i * n + j] = K[j * n + i] = 0.5 * (K[i * n + j] + K[j * n + i]);
    }
  EXPECT_LT(apart, 1e-5);
  return eigenvalues(K, n);
}

// A cell has six modes without stiffness, the rigid ones, down to the emptiest cell that is kept: no
// hourglass modes.
TEST(SolidElement, OnlyRigidModesAreFree) {
  // Tissue in the cell: whole, half, a corner, a sliver at the least share.
  const double sizes[][3] = {{1, 1, 1}, {1, 1, 0.5}, {0.6, 0.6, 0.6}, {1, 1, 0.1}, {0.45, 0.45, 0.45}};
  for (const std::string& law : laws()) {
    double whole = 0;
    for (const auto& size : sizes) {
      std::array<double, 4> quarters{};
      const std::vector<double> found = modes_of_cell(law, size[0], size[1], size[2], &quarters);
      if (whole == 0) whole = found[6];
      EXPECT_LT(std::abs(found[5]), 1e-5 * found[6]) << law << " " << size[2];
      EXPECT_LT(std::abs(found[0]), 1e-5 * found[6]) << law << " " << size[2];
      // The softest of the others: at least the floor's share of that of a whole cell.
      EXPECT_GT(found[6], 0.99 * SolidMesh::mass_floor * whole) << law << " " << size[2];
      std::printf(
          "%s, tissue %g x %g x %g: quarters %.2f %.2f %.2f %.2f, modes 6 to 8 and the last %.4f %.4f %.4f "
          "%.1f kPa mm\n",
          law.c_str(), size[0], size[1], size[2], quarters[0], quarters[1], quarters[2], quarters[3],
          found[6], found[7], found[8], found[23]);
    }
  }
}

}  // namespace
}  // namespace cohort::test
