// The diffusion stencil: its eigenvalues, its order, its balance (kernels/stencil.cl).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using std::numbers::pi;

// Eigenvalues of the symmetric matrix a (n x n), ascending, by Jacobi rotations.
std::vector<double> eigenvalues(std::vector<double> a, std::size_t n) {
  for (int sweep = 0; sweep < 60; ++sweep) {
    double off = 0, all = 0;
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = 0; q < n; ++q) (p == q ? all : off) += a[p * n + q] * a[p * n + q];
    if (off < 1e-26 * all) break;
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        if (a[p * n + q] == 0) continue;
        const double theta = (a[q * n + q] - a[p * n + p]) / (2 * a[p * n + q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (std::size_t k = 0; k < n; ++k) {
          const double x = a[k * n + p], y = a[k * n + q];
          a[k * n + p] = c * x - s * y;
          a[k * n + q] = s * x + c * y;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double x = a[p * n + k], y = a[q * n + k];
          a[p * n + k] = c * x - s * y;
          a[q * n + k] = s * x + c * y;
        }
      }
  }
  std::vector<double> result;
  for (std::size_t p = 0; p < n; ++p) result.push_back(a[p * n + p]);
  std::sort(result.begin(), result.end());
  return result;
}

// Tissue with given tensors: tensor(centre) gives xx yy zz xy xz yz in mm2/ms, share(centre) the cell's
// fraction.
struct Medium : Slab {
  using Tensor = std::array<double, 6>;
  Medium(
      std::array<double, 3> size, double h, Precision precision,
      const std::function<Tensor(std::array<double, 3>)>& tensor,
      const std::function<double(std::array<double, 3>)>& share = [](auto) { return 1.0; })
      : Slab(size, h, precision, "pathmanathan_gray", {}) {
    const auto stride = static_cast<size_t>(tissue->stride);
    std::vector<double> tensors(6 * stride, 0.0), inverse(stride, 0.0);
    capacity.assign(stride, 0.0);
    each_cell([&](std::size_t i, const std::array<double, 3>& p) {
      capacity[i] = share(p);
      if (capacity[i] <= 0) return;
      inverse[i] = 1 / capacity[i];
      const Tensor t = tensor(p);
      for (size_t c = 0; c < 6; ++c) tensors[c * stride + i] = t[c] / (h * h);
      cells.push_back(i);
    });
    write(tissue->capacity, capacity);
    write(tissue->inverse_capacity, inverse);
    const cl::Buffer buffer = device().allocate(tensors.size() * real_bytes(precision));
    write(buffer, tensors);
    diffusion->assemble_tensors(*tissue, buffer, Diffusion::Use::monodomain, monodomain->stencil());
    monodomain->initialise(*tissue, parameters, 2.0, 1);
    applied_ = device().allocate(static_cast<size_t>(tissue->stride) * real_bytes(precision));
  }
  // L u of a field (stride).
  std::vector<double> apply(const std::vector<double>& u) {
    write(monodomain->potential(), u);
    monodomain->diffusion_stage(*tissue, monodomain->potential(), monodomain->potential(), applied_, 1.0);
    std::vector<double> result = read(applied_, u.size());
    for (std::size_t i = 0; i < u.size(); ++i) result[i] -= u[i];
    return result;
  }
  // capacity x L, dense over the tissue cells.
  std::vector<double> matrix() {
    const std::size_t n = cells.size();
    std::vector<double> a(n * n);
    for (std::size_t column = 0; column < n; ++column) {
      std::vector<double> unit(static_cast<size_t>(tissue->stride), 0.0);
      unit[cells[column]] = 1;
      const std::vector<double> result = apply(unit);
      for (std::size_t row = 0; row < n; ++row)
        a[row * n + column] = capacity[cells[row]] * result[cells[row]];
    }
    return a;
  }
  std::vector<double> capacity;
  std::vector<std::size_t> cells;

 private:
  cl::Buffer applied_;
};

Medium::Tensor along(std::array<double, 3> f, double longitudinal, double transverse) {
  const double length = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  for (double& c : f) c /= length;
  const double d = longitudinal - transverse;
  return {transverse + d * f[0] * f[0],
          transverse + d * f[1] * f[1],
          transverse + d * f[2] * f[2],
          d * f[0] * f[1],
          d * f[0] * f[2],
          d * f[1] * f[2]};
}

void expect_symmetric_and_semidefinite(Medium& medium, int expected_null_modes) {
  const std::vector<double> a = medium.matrix();
  const std::size_t n = medium.cells.size();
  double asymmetry = 0, largest = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      asymmetry = std::max(asymmetry, std::abs(a[i * n + j] - a[j * n + i]));
      largest = std::max(largest, std::abs(a[i * n + j]));
    }
  EXPECT_LT(asymmetry, 1e-13 * largest);
  const std::vector<double> values = eigenvalues(a, n);
  int null_modes = 0;
  for (const double value : values) null_modes += std::abs(value) < 1e-10 * largest;
  std::printf("%zu cells: eigenvalues %.3e ... %.3e, %.3e; null modes %d\n", n, values.front(), values[n - 2],
              values[n - 1], null_modes);
  EXPECT_LT(values.back(), 1e-12 * largest) << "a growing mode";
  EXPECT_EQ(null_modes, expected_null_modes);
}

TEST(Stencil, HasNoNullModeButTheConstantOnUniformTissue) {
  Medium medium({6, 5, 4}, 1, Precision::double_, [](auto) { return along({1, 2, 3}, 1.0, 0.1); });
  expect_symmetric_and_semidefinite(medium, 1);
  // The slowest mode is a smooth one: of the size pi^2 D / L^2 and not less.
  const std::vector<double> values = eigenvalues(medium.matrix(), medium.cells.size());
  EXPECT_LT(values[values.size() - 2], -0.5 * pi * pi * 0.1 / 36);
}

TEST(Stencil, HasNoNullModeButTheConstantOnTornTissueOfCutCells) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 6; ++trial) {
    // One cell in eight is missing, one in three is cut; fibres turn at random from cell to cell.
    Medium medium(
        {7, 5, 4}, 1, Precision::double_,
        [&](auto) {
          return along({uniform(random) - 0.5, uniform(random) - 0.5, uniform(random) - 0.5}, 1.0, 0.1);
        },
        [&](auto) {
          const double draw = uniform(random);
          return draw < 0.125 ? 0.0 : draw < 0.4 ? 0.05 + 0.9 * uniform(random) : 1.0;
        });
    // Pieces that hang together by faces each have their constant.
    std::vector<double> a = medium.matrix();
    const std::size_t n = medium.cells.size();
    std::vector<std::size_t> piece(n);
    for (std::size_t i = 0; i < n; ++i) piece[i] = i;
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j)
          if (std::abs(a[i * n + j]) > 1e-14 && piece[j] < piece[i]) {
            piece[i] = piece[j];
            changed = true;
          }
    }
    int pieces = 0;
    for (std::size_t i = 0; i < n; ++i) pieces += piece[i] == i;
    expect_symmetric_and_semidefinite(medium, pieces);
  }
}

// Largest error of L u against div(D grad u) in the interior, relative to its largest value; fibres turn with
// z.
double operator_error(int n) {
  const double h = 1.0 / n, longitudinal = 1.0, transverse = 0.2, turn = 1.5;
  Medium medium({1, 1, 1}, h, Precision::double_, [&](std::array<double, 3> p) {
    return along({std::cos(turn * p[2]), std::sin(turn * p[2]), 0}, longitudinal, transverse);
  });
  const double kx = 2, ky = 3, kz = 2.5;
  const auto u = [&](double x, double y, double z) {
    return std::sin(kx * x) * std::cos(ky * y) * std::sin(kz * z);
  };
  const std::vector<double> result = medium.apply(medium.field(u));
  double error = 0, largest = 0;
  medium.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const auto [x, y, z] = p;
    if (std::min({x, y, z, 1 - x, 1 - y, 1 - z}) < 2 * h) return;
    const Medium::Tensor D = along({std::cos(turn * z), std::sin(turn * z), 0}, longitudinal, transverse);
    const double exact = -(D[0] * kx * kx + D[1] * ky * ky + D[2] * kz * kz) * u(x, y, z) -
                         2 * D[3] * kx * ky * std::cos(kx * x) * std::sin(ky * y) * std::sin(kz * z);
    error = std::max(error, std::abs(result[i] - exact));
    largest = std::max(largest, std::abs(exact));
  });
  return error / largest;
}

TEST(Stencil, IsOfSecondOrderForTurningFibres) {
  double previous = 0;
  for (const int n : {8, 16, 32}) {
    const double error = operator_error(n);
    std::printf("n %2d  error %.3e  order %.2f\n", n, error,
                previous > 0 ? std::log2(previous / error) : 0.0);
    if (n == 32) {
      EXPECT_GE(std::log2(previous / error), 1.9);
    }
    previous = error;
  }
  EXPECT_LT(previous, 4e-3);
}

// A linear field without flux through the faces x = 0, 1 and z = 0, 1 is a steady state away from the ends in
// y, for whatever tensor: the boundary's own cells included, to rounding.
TEST(Stencil, KeepsALinearFieldWithoutFluxThroughObliqueBoundaries) {
  constexpr double h = 0.125;
  const Medium::Tensor D = along({1, 2, -1.5}, 1.0, 0.1);
  // Gradient (a, 1, c) with D_xx a + D_xy + D_xz c = 0 and D_xz a + D_yz + D_zz c = 0.
  const double determinant = D[0] * D[2] - D[4] * D[4];
  const double a = (-D[3] * D[2] + D[4] * D[5]) / determinant, c = (-D[0] * D[5] + D[4] * D[3]) / determinant;
  Medium medium({1, 2, 1}, h, Precision::double_, [&](auto) { return D; });
  const std::vector<double> result =
      medium.apply(medium.field([&](double x, double y, double z) { return a * x + y + c * z; }));
  double largest = 0;
  medium.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    if (p[1] > 2 * h && p[1] < 2 - 2 * h) largest = std::max(largest, std::abs(result[i]));
  });
  std::printf("largest |L u| %.2e, beside D / h^2 = %.1f\n", largest, D[1] / (h * h));
  EXPECT_LT(largest, 1e-12);
}

// Diffusion in a box whose fibres lie oblique to its faces, against the finest grid: the boundary takes part.
// Strong anisotropy would make the box's corners singular and hide the scheme's order.
std::vector<double> decayed(int n) {
  const double h = 1.0 / n;
  Medium medium({1, 1, h}, h, Precision::double_, [](auto) { return along({1, 1, 0}, 1.0, 0.6); });
  const double dt = 0.2 * h * h;
  medium.monodomain->initialise(*medium.tissue, medium.parameters, 2 * dt, 1);
  // Flat at the boundary, so that the initial data agree with its condition; skewed, so that no symmetry
  // hides errors.
  std::vector<double> u = medium.field([](double x, double y, double) {
    return std::pow(std::sin(pi * x) * std::sin(pi * y), 2) * (1 + x - 0.5 * y);
  });
  const auto steps = static_cast<int>(std::lround(0.05 / dt));
  for (int step = 0; step < steps; ++step) {
    medium.write(medium.monodomain->potential(), u);
    u = medium.read(medium.monodomain->closed_potential(*medium.tissue), u.size());
  }
  std::vector<double> result;  // rows along x, the box is one cell deep
  for (const std::size_t i : medium.cells) result.push_back(u[i]);
  return result;
}

// Root mean square difference between a grid and the mean of the four cells of one twice as fine.
double difference(const std::vector<double>& coarse, const std::vector<double>& fine, std::size_t n) {
  double sum = 0;
  for (std::size_t y = 0; y < n; ++y)
    for (std::size_t x = 0; x < n; ++x) {
      const std::size_t corner = 4 * n * y + 2 * x;
      const double mean =
          (fine[corner] + fine[corner + 1] + fine[corner + 2 * n] + fine[corner + 2 * n + 1]) / 4;
      sum += std::pow(coarse[n * y + x] - mean, 2);
    }
  return std::sqrt(sum / static_cast<double>(n * n));
}

TEST(Stencil, ConvergesAtObliqueFibresWithBoundaries) {
  const std::vector<double> coarse = decayed(16), middle = decayed(32), fine = decayed(64);
  const double first = difference(coarse, middle, 16), second = difference(middle, fine, 32);
  std::printf("differences %.3e %.3e  order %.2f\n", first, second, std::log2(first / second));
  EXPECT_GE(std::log2(first / second), 1.9);
}

class Balance : public testing::TestWithParam<Precision> {};

TEST_P(Balance, NothingIsLostThroughTheSurface) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  Medium medium(
      {20, 15, 10}, 1, GetParam(),
      [](std::array<double, 3> p) {
        return along({1, p[2] - 5, p[1] - 7}, 0.1, 0.02);
      },
      [&](auto) { return uniform(random) < 0.2 ? 0.0 : 0.1 + 0.9 * uniform(random); });
  std::vector<double> u = medium.field([&](auto...) { return 100 * uniform(random); });
  const auto content = [&] {
    long double sum = 0;  // the sum's own rounding must not count
    for (const std::size_t i : medium.cells) sum += static_cast<long double>(medium.capacity[i]) * u[i];
    return static_cast<double>(sum);
  };
  medium.monodomain->initialise(*medium.tissue, medium.parameters, 2.0, 1);
  const double before = content();
  constexpr int steps = 200;
  for (int step = 0; step < steps; ++step) {
    medium.write(medium.monodomain->potential(), u);
    u = medium.read(medium.monodomain->closed_potential(*medium.tissue), u.size());
  }
  const double epsilon = GetParam() == Precision::double_ ? 2.3e-16 : 1.2e-7;
  std::printf("relative drift over %d steps %.2e, rounding %.1e\n", steps, std::abs(content() / before - 1),
              epsilon);
  EXPECT_LT(std::abs(content() / before - 1), 4 * epsilon);  // 200 roundings of 2000 cells, of either sign
}
INSTANTIATE_TEST_SUITE_P(Precisions, Balance, testing::Values(Precision::single_, Precision::double_),
                         [](const auto& test) {
                           return test.param == Precision::single_ ? "single" : "double";
                         });

}  // namespace
}  // namespace cohort::test
