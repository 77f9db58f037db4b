// The deforming tissue in motion: order in space and time against exact motions, energy, coming to rest.
#include <numbers>

#include "tests/laws.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

constexpr double mu = 5, kappa = 10, side = 6;  // kPa, kPa, mm

/// First Piola-Kirchhoff stress of the neo-Hookean law with kappa/2 (J - 1)^2, from its formula.
Matrix stress(const Matrix& F) {
  const double J = determinant(F);
  Matrix cofactor{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      cofactor[i][j] = F[a][c] * F[b][d] - F[a][d] * F[b][c];
    }
  double I1 = 0;
  for (const Vector& row : F)
    for (const double x : row) I1 += x * x;
  const double j = std::pow(J, -2.0 / 3);
  Matrix P{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      P[i][k] = mu * j * (F[i][k] - I1 / 3 * cofactor[i][k] / J) + kappa * (J - 1) * cofactor[i][k];
  return P;
}

/// The motion that the tests make: a standing wave of finite size.
struct Wave {
  static constexpr double size = 0.25, omega = 1.3;  // mm, 1/ms
  static constexpr double wave = std::numbers::pi / side;
  static double clock(double t) { return std::cos(omega * t + 0.4); }
  static Vector shape(const Vector& X) {
    const double x = wave * X[0], y = wave * X[1], z = wave * X[2];
    return {size * std::sin(x + 0.3) * std::cos(0.7 * y) * std::sin(z + 0.5),
            size * std::cos(0.8 * x) * std::sin(y + 0.2) * std::cos(z),
            size * std::sin(0.9 * x) * std::sin(0.6 * y + 0.1) * std::cos(1.1 * z + 0.6)};
  }
  static Vector u(const Vector& X, double t) { return scaled(shape(X), clock(t)); }
  static Vector v(const Vector& X, double t) { return scaled(shape(X), -omega * std::sin(omega * t + 0.4)); }
  static Vector a(const Vector& X, double t) { return scaled(shape(X), -omega * omega * clock(t)); }
  static Vector scaled(Vector x, double by) {
    for (double& component : x) component *= by;
    return x;
  }
  static Matrix F(const Vector& X, double t) {
    constexpr double e = 1e-3;
    Matrix result{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = [&](double along) {
        Vector moved = X;
        moved[k] += along;
        return u(moved, t);
      };
      const Vector a = at(e), b = at(-e), c = at(2 * e), d = at(-2 * e);
      for (std::size_t i = 0; i < 3; ++i)
        result[i][k] = (8 * (a[i] - b[i]) - (c[i] - d[i])) / (12 * e) + (i == k);
    }
    return result;
  }
  /// Div P, by differences of fourth order.
  static Vector divergence(const Vector& X, double t) {
    constexpr double e = 1e-2;
    Vector result{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = [&](double along) {
        Vector moved = X;
        moved[k] += along;
        return stress(F(moved, t));
      };
      const Matrix a = at(e), b = at(-e), c = at(2 * e), d = at(-2 * e);
      for (std::size_t i = 0; i < 3; ++i)
        result[i] += (8 * (a[i][k] - b[i][k]) - (c[i][k] - d[i][k])) / (12 * e);
    }
    return result;
  }
};

SolidRun wave_box(int cells) {
  Settings set = box_size(side, side, side, side / cells);
  set.insert(set.end(), {{"mechanics.neo_hookean.mu_kPa", mu},
                         {"mechanics.bulk_modulus_kPa", kappa},
                         {"mechanics.density_mg_per_mm3", 1}});
  return SolidRun(box_of_tissue("neo_hookean", Precision::double_), set);
}

double rms_error(const SolidRun& run, const std::vector<double>& u, double t) {
  double sum = 0, count = 0;
  for (std::size_t a = 0; a < run.nodes(); ++a) {
    if (!run.is_node(a)) continue;
    const Vector exact = Wave::u(run.place(a), t);
    for (std::size_t k = 0; k < 3; ++k) {
      const double e = u[k * run.nodes() + a] - exact[k];
      sum += e * e;
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

// Against the equations: the body force that keeps up the wave is that of the formulas, the surface is held
// on it.
double error_in_space(int cells, double end, int steps) {
  SolidRun run = wave_box(cells);
  const double dt = end / steps;
  std::vector<double> u = run.field([](const Vector& X) { return Wave::u(X, 0); });
  std::vector<double> v = run.field([&](const Vector& X) { return Wave::v(X, -0.5 * dt); });
  for (int n = 0; n < steps; ++n) {
    const double t = n * dt;
    for (std::size_t a = 0; a < run.nodes(); ++a) {
      if (!run.is_node(a) || !run.within_tissue(a)) continue;
      const Vector X = run.place(a), pull = Wave::divergence(X, t), acceleration = Wave::a(X, t);
      for (std::size_t k = 0; k < 3; ++k)
        v[k * run.nodes() + a] += dt * (acceleration[k] - pull[k]);  // density 1
    }
    run.set(u, v, dt);
    run.step();
    u = run.solid->displacement();
    v = run.solid->velocity();
    for (std::size_t a = 0; a < run.nodes(); ++a) {
      if (!run.is_node(a) || run.within_tissue(a)) continue;
      const Vector exact = Wave::u(run.place(a), t + dt);
      for (std::size_t k = 0; k < 3; ++k) u[k * run.nodes() + a] = exact[k];
    }
  }
  return rms_error(run, u, end);
}

TEST(SolidDynamics, SecondOrderInSpace) {
  constexpr double end = 1;  // ms
  const std::vector<double> errors = {error_in_space(4, end, 20), error_in_space(8, end, 40),
                                      error_in_space(16, end, 80)};
  for (std::size_t i = 0; i < errors.size(); ++i)
    std::printf("dx %.3f mm: error %.3e mm%s\n", side / (4 << i), errors[i],
                i ? (", order " + std::to_string(std::log2(errors[i - 1] / errors[i]))).c_str() : "");
  EXPECT_LT(errors[2], 1e-3);
  EXPECT_GT(std::log2(errors[1] / errors[2]), 1.9);
}

// Against the equations of the grid: the body force is what the grid's own forces lack, so that time alone
// errs.
double error_in_time(double end, int steps) {
  SolidRun run = wave_box(4);
  const double dt = end / steps;
  std::vector<double> u = run.field([](const Vector& X) { return Wave::u(X, 0); });
  std::vector<double> v = run.field([&](const Vector& X) { return Wave::v(X, -0.5 * dt); });
  for (int n = 0; n < steps; ++n) {
    const double t = n * dt;
    const std::vector<double> f = run.forces(run.field([&](const Vector& X) { return Wave::u(X, t); }));
    for (std::size_t a = 0; a < run.nodes(); ++a) {
      if (!run.is_node(a)) continue;
      const Vector acceleration = Wave::a(run.place(a), t);
      for (std::size_t k = 0; k < 3; ++k)
        v[k * run.nodes() + a] += dt * (acceleration[k] - f[k * run.nodes() + a] / run.mass(a));
    }
    run.set(u, v, dt);
    run.step();
    u = run.solid->displacement();
    v = run.solid->velocity();
  }
  return rms_error(run, u, end);
}

TEST(SolidDynamics, SecondOrderInTime) {
  constexpr double end = 3;  // ms
  const std::vector<double> errors = {error_in_time(end, 25), error_in_time(end, 50),
                                      error_in_time(end, 100)};
  for (std::size_t i = 0; i < errors.size(); ++i)
    std::printf("dt %.3f ms: error %.3e mm%s\n", end / (25 << i), errors[i],
                i ? (", order " + std::to_string(std::log2(errors[i - 1] / errors[i]))).c_str() : "");
  EXPECT_LT(errors[2], 1e-3);
  EXPECT_GT(std::log2(errors[1] / errors[2]), 1.9);
}

Settings ventricle(double dx) {
  Settings set = ellipsoids({20, 20, 60}, 9.5, dx);
  set.insert(set.end(), {{"geometry.shapes.below_base.half_space.point_mm.z", 0},
                         {"mechanics.damping_per_ms", 0},
                         {"time.end_ms", 800}});
  return set;
}

// A ventricle, let go from a stretched state without damping, keeps its energy over a beat.
TEST(SolidDynamics, EnergyDriftsLittle) {
  for (const Precision precision : {Precision::double_, Precision::single_}) {
    SolidRun run(hollow(true, "guccione", precision, true), ventricle(4));
    ASSERT_EQ(run.solid->defect(0), "");
    run.solid->set_motion(run.field([](const Vector& X) {
      const double depth = -X[2] / 60;
      return Vector{12 * depth * depth, 5 * depth, 0};
    }),
                          run.at_rest());
    double first = 0, least = 1e30, most = 0, most_kinetic = 0;
    int steps = 0;
    for (double time = 0; time < 800;) {
      const std::vector<double> before = run.solid->velocity();
      run.loaded_step(true);
      const std::vector<double> after = run.solid->velocity(), S = run.solid->state();
      time = S[Solid::time];
      if (S[Solid::ended] != 0) break;
      // Velocities stand between steps: at the step, their mean.
      double kinetic = 0;
      for (std::size_t a = 0; a < run.nodes(); ++a)
        for (std::size_t k = 0; run.is_node(a) && k < 3; ++k) {
          const double v = 0.5 * (before[k * run.nodes() + a] + after[k * run.nodes() + a]);
          kinetic += 0.5 * run.mass(a) * v * v;
        }
      const double energy = S[Solid::strain_energy] + kinetic;
      if (first == 0) first = energy;
      least = std::min(least, energy);
      most = std::max(most, energy);
      most_kinetic = std::max(most_kinetic, kinetic);
      for (int k = 0; k < 31; ++k) run.loaded_step(k == 15);
      steps += 32;
    }
    const std::vector<double> S = run.solid->state();
    std::printf(
        "%s: %d cells, %d steps to %.1f ms, energy %.4f uJ, drift %.3f to %.3f %%, kinetic up to %.1f %%\n",
        precision == Precision::double_ ? "double" : "single", run.mesh().tissue_cells[0], steps,
        S[Solid::time], first, 100 * (least / first - 1), 100 * (most / first - 1),
        100 * most_kinetic / first);
    EXPECT_GE(S[Solid::time], 800);
    EXPECT_EQ(S[Solid::ended], static_cast<double>(SolidEnd::settled));
    EXPECT_GT(most_kinetic, 0.2 * first);
    EXPECT_LT(most / first - 1, 5e-3);
    EXPECT_GT(least / first - 1, -5e-3);
  }
}

// The patch test as a solve: the surface is held on an affine displacement, the inside starts elsewhere and
// comes to rest on it.
TEST(SolidDynamics, TissueHeldOnAnAffineMotionComesToRestOnIt) {
  std::vector<Mechanics::Boundary> held;
  for (const char* face : {"x_lower", "x_upper", "y_lower", "y_upper", "z_lower", "z_upper"})
    held.push_back({face, face, Mechanics::Boundary::Kind::clamp});
  Scene scene = box_of_tissue("neo_hookean", Precision::double_, held);
  scene.mechanics->quasi_static = true;
  Settings set = box_size(4, 4, 4, 1);
  set.insert(set.end(), {{"mechanics.load.ramp_ms", 1e6},
                         {"mechanics.load.at_most_ms", 1e6},
                         {"mechanics.neo_hookean.mu_kPa", 50},
                         {"mechanics.bulk_modulus_kPa", 100}});
  SolidRun run(std::move(scene), set);
  const Matrix G = {{{0.08, 0.05, -0.03}, {-0.04, -0.06, 0.07}, {0.02, 0.03, 0.05}}};
  const std::vector<double> affine = run.field([&](const Vector& X) { return times(G, X); });
  std::vector<double> u = affine;
  for (std::size_t a = 0; a < run.nodes(); ++a)
    for (std::size_t k = 0; k < 3; ++k)
      if (run.is_node(a) && run.within_tissue(a)) u[k * run.nodes() + a] = 0;
  run.solid->set_motion(u, run.at_rest());
  for (int step = 0; step < 6000; ++step) run.loaded_step(step % 16 == 0);
  u = run.solid->displacement();
  double apart = 0;
  for (std::size_t i = 0; i < u.size(); ++i) apart = std::max(apart, std::abs(u[i] - affine[i]));
  EXPECT_LT(apart, 1e-12);
}

}  // namespace
}  // namespace cohort::test
