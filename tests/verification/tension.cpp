// Active tensions of kernels/tension, stepped by the kernels themselves: against their equations integrated
// here by the classical Runge-Kutta method with steps of 0.002 ms, closed forms, and published figures.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "tests/laws.hpp"

namespace cohort::test {
namespace {

using Function = std::function<double(double)>;

/// What a fibre undergoes over time, ms. drive: mV or mM.
struct Course {
  Function drive = [](double) { return 0.0; };
  Function stretch = [](double) { return 1.0; };
  double activation_ms = 0, beat_ms = 1e6, end_ms = 800;
};

Scene active(const std::string& tension) {
  return solid_box("guccione", tension,
                   tension == "calcium" ? "ten_tusscher_panfilov" : "mitchell_schaeffer");
}

/// T at the end of every step; `last`: states at the end, then tension_stiffness.
struct Series {
  double dt;
  std::vector<double> T, last;
  double at(double t) const { return T[static_cast<std::size_t>(std::lround(t / dt)) - 1]; }
};

Series run(const std::string& tension, const Course& course, double dt,
           Precision precision = Precision::double_, const std::map<std::string, double>& set = {}) {
  static const std::string source = R"(
#define ROOM (TENSION_STATES > 0 ? TENSION_STATES : 1)
kernel void step_tension(global const real *P, global const real *in, global real *out, const int count) {
  if (get_global_id(0) > 0) return;
  const real dt = in[0], beat = in[1];
  const int steps = (int)in[2];
  global const real *M = P + material_first[0];
  real state[ROOM], T = 0;
  for (int k = 0; k < ROOM; ++k) state[k] = 0;
  for (int i = 0; i < steps; ++i) {
    global const real *x = in + 3 + 4 * i;
    T = tension_step(state, x[0], beat, x[1], x[2], x[3], dt, M);
    out[i] = T;
  }
  for (int k = 0; k < TENSION_STATES; ++k) out[steps + k] = state[k];
  out[steps + TENSION_STATES] = tension_stiffness(state, T, in[3 + 4 * (steps - 1) + 2], M);
}
)";
  const Scene scene = active(tension);
  const int steps = static_cast<int>(std::lround(course.end_ms / dt));
  std::vector<double> input = {dt, course.beat_ms, static_cast<double>(steps)};
  for (int i = 0; i < steps; ++i) {
    const double from = i * dt, to = from + dt;
    input.insert(input.end(), {to - course.activation_ms, course.drive(from + dt / 2), course.stretch(to),
                               (course.stretch(to) - course.stretch(from)) / dt});
  }
  const auto states = static_cast<std::size_t>(read_tension(tension).states),
             n = static_cast<std::size_t>(steps);
  const std::vector<double> out =
      run_solid(scene, precision, source, "step_tension", solid_values(scene, set), input, n + states + 1, 1);
  const auto middle = out.begin() + steps;
  return {dt, {out.begin(), middle}, {middle, out.end()}};
}

/// y' = rate(t, y), from 0; `each(t, y)` after each of its steps that ends on a multiple of 0.1 ms.
template <std::size_t N>
void integrate(const std::function<std::array<double, N>(double, const std::array<double, N>&)>& rate,
               double end, const std::function<void(double, const std::array<double, N>&)>& each) {
  constexpr double h = 0.002;
  std::array<double, N> y{};
  const auto moved = [&](const std::array<double, N>& k, double by) {
    std::array<double, N> z = y;
    for (std::size_t i = 0; i < N; ++i) z[i] += by * k[i];
    return z;
  };
  const int steps = static_cast<int>(std::lround(end / h));
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    const auto a = rate(t, y), b = rate(t + h / 2, moved(a, h / 2)), c = rate(t + h / 2, moved(b, h / 2)),
               d = rate(t + h, moved(c, h));
    for (std::size_t k = 0; k < N; ++k) y[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
    if ((i + 1) % 50 == 0) each((i + 1) * h, y);
  }
}

double maximum(const std::vector<double>& T) {
  return *std::max_element(T.begin(), T.end());
}

double breathing(double t) {
  return 1.02 + 0.08 * std::sin(2 * std::numbers::pi * t / 400);
}
double breathing_rate(double t) {
  return 0.08 * 2 * std::numbers::pi / 400 * std::cos(2 * std::numbers::pi * t / 400);
}
double potential(double t) {
  return -80 + 110 / (1 + std::exp(-(t - 20) / 0.5)) / (1 + std::exp((t - 300) / 8));
}
double calcium(double t) {  // mM
  return 1e-4 + (t > 10 ? 2.2e-3 * (std::exp(-(t - 10) / 90) - std::exp(-(t - 10) / 25)) : 0);
}
double hill(double rate, double v, double a) {
  const double Q = rate / (a * v);
  return Q < 0 ? std::max((1 + a * Q) / (1 - Q), 0.0) : (1 + (2 + a) * Q) / (1 + Q);
}

// Largest difference from the reference over time, as a share of its peak.
template <std::size_t N>
double error_of(const Series& series, double end,
                const std::function<std::array<double, N>(double, const std::array<double, N>&)>& rate,
                const std::function<double(double, const std::array<double, N>&)>& tension) {
  double worst = 0, peak = 0;
  const auto every = static_cast<int>(std::lround(series.dt / 0.1));
  int count = 0;
  integrate<N>(rate, end, [&](double t, const std::array<double, N>& y) {
    const double T = tension(t, y);
    peak = std::max(peak, T);
    if (++count % every == 0) worst = std::max(worst, std::abs(series.at(t) - T));
  });
  return worst / peak;
}

TEST(Bestel, HasTheMaximaOfTheBenchmark) {
  // tests/reference: computed with scipy (solve_ivp, RK45, tolerance 1e-9) from the benchmark's equations;
  // also the project's specification.
  constexpr double tau_kPa = 118.106, tau_at_ms = 479.5, pressure_kPa = 16.074;
  const Scene scene = active("bestel");
  for (const Precision precision : {Precision::double_, Precision::single_})
    for (const double dt : {0.1, 1.0}) {
      const Series series = run("bestel", {}, dt, precision);
      const auto top = std::max_element(series.T.begin(), series.T.end());
      const double at = static_cast<double>(top - series.T.begin() + 1) * dt;
      const std::vector<double> p = run_solid(scene, precision, R"(
kernel void pressure_of(global const real *P, global const real *in, global real *out, const int count) {
  if (get_global_id(0) > 0) return;
  real p = 0;
  for (int i = 0; i < (int)in[1]; ++i) {
    p = bestel_pressure_step(p, (i + 1) * in[0], in[0], P + material_first[0]);
    out[i] = p;
  }
}
)",
                                              "pressure_of", solid_values(scene, {}), {dt, 800 / dt},
                                              static_cast<std::size_t>(std::lround(800 / dt)), 1);
      std::printf("| bestel | %s, dt %.1f ms | greatest tension kPa, at ms | %.3f at %.1f | %.3f at %.1f |\n",
                  precision == Precision::double_ ? "double" : "single", dt, tau_kPa, tau_at_ms, *top, at);
      std::printf("| bestel | %s, dt %.1f ms | greatest pressure kPa | %.3f | %.3f |\n",
                  precision == Precision::double_ ? "double" : "single", dt, pressure_kPa, maximum(p));
      EXPECT_NEAR(*top, tau_kPa, 1e-3 * tau_kPa);
      EXPECT_NEAR(at, tau_at_ms, dt);
      EXPECT_NEAR(maximum(p), pressure_kPa, 1e-3 * pressure_kPa);
    }
}

TEST(Bestel, FollowsItsEquation) {
  const std::function<std::array<double, 1>(double, const std::array<double, 1>&)> rate = [](double t,
                                                                                             const auto& y) {
    const auto S = [](double x, double sign) { return (1 + sign * std::tanh(x / 5)) / 2; };
    const double f = S(t - 160, 1) * S(t - 484, -1), a = (5 * f - 30 * (1 - f)) / 1000;
    return std::array<double, 1>{-std::abs(a) * y[0] + 150 * std::max(a, 0.0)};
  };
  double before = 0;
  for (const double dt : {0.4, 0.2, 0.1}) {
    const double error =
        error_of<1>(run("bestel", {}, dt), 800, rate, [](double, const auto& y) { return y[0]; });
    std::printf("| bestel | double, dt %.1f ms | error over peak | %.2e |\n", dt, error);
    EXPECT_LT(error, 1e-3 * dt);
    // Second order but for the corner where a changes its sign.
    if (before > 0) {
      EXPECT_LT(error, before / 2.5);
    }
    before = error;
  }
}

TEST(Twitch, IsItsFormula) {
  const auto formula = [](double t, double stretch, double duration) {
    const double rise = std::tanh(t / 58), fall = std::tanh((duration - t) / 35);
    return t < 0 || t > duration
               ? 0
               : 205 * rise * rise * fall * fall * std::max(0.0, std::tanh(2 * (stretch - 0.7)));
  };
  for (const Precision precision : {Precision::double_, Precision::single_}) {
    const Series series =
        run("twitch", {.stretch = breathing, .activation_ms = 30, .beat_ms = 800}, 0.5, precision);
    for (double t = 0.5; t <= 800; t += 0.5)
      EXPECT_NEAR(series.at(t), formula(t - 30, breathing(t), 430),
                  precision == Precision::double_ ? 1e-11 : 1e-4);
  }
  // A beat of 400 ms shortens it: it ends as smoothly, where it would be cut 25 ms before its end.
  const Series brief = run("twitch", {.beat_ms = 400, .end_ms = 400}, 0.5);
  EXPECT_NEAR(brief.at(399.5), 0, 1.6e-4 * 205);
  EXPECT_NEAR(brief.at(300), formula(300, 1, 400), 1e-11);
  EXPECT_GT(formula(400, 1, 430), 20);
  // It goes on over the end of a beat, 100 ms after an activation late in it.
  const Series late = run("twitch", {.activation_ms = 700, .beat_ms = 800, .end_ms = 1000}, 0.5);
  EXPECT_NEAR(late.at(900), formula(200, 1, 430), 1e-11);
  EXPECT_EQ(late.at(650), 0);
  // No stretch below the zero of length pulls.
  EXPECT_EQ(maximum(run("twitch", {.stretch = [](double) { return 0.6; }}, 1).T), 0);
}

TEST(Twitch, FeelsVelocityBehindItsLag) {
  constexpr double v = 0.005, a = 0.35, lag = 20;
  const std::map<std::string, double> set = {
      {"shortening_per_ms", v}, {"velocity_lag_ms", lag}, {"hill_a", a}};
  const Course course = {.stretch = breathing};
  const Series free = run("twitch", course, 0.2);
  double before = 0;
  for (const double dt : {0.4, 0.2}) {
    const double error = error_of<1>(
        run("twitch", course, dt, Precision::double_, set), 800,
        [&](double t, const auto& y) { return std::array<double, 1>{(breathing_rate(t) - y[0]) / lag}; },
        [&](double t, const auto& y) {
          const double rise = std::tanh(t / 58), fall = std::tanh(std::max(430 - t, 0.0) / 35);
          return 205 * rise * rise * fall * fall * std::tanh(2 * (breathing(t) - 0.7)) * hill(y[0], v, a);
        });
    std::printf("| twitch with velocity | double, dt %.1f ms | error over peak | %.2e |\n", dt, error);
    EXPECT_LT(error, 1e-3 * dt);
    if (before > 0) {
      EXPECT_LT(error, before / 3);
    }
    before = error;
  }
  // A constant rate ends at Hill's curve: half the unloaded rate leaves (1 - 1/2) / (1 + 1 / (2 a)) of the
  // tension, the whole nothing, a fast stretch at most 2 + a.
  const auto ratio = [&](double rate) {
    const Course steady = {.stretch = [rate](double t) { return 1 + rate * (t - 200); }, .end_ms = 200};
    return run("twitch", steady, 0.2, Precision::double_, set).at(200) / run("twitch", steady, 0.2).at(200);
  };
  EXPECT_NEAR(ratio(-v / 2), 0.5 / (1 + 0.5 / a), 1e-4);
  EXPECT_NEAR(ratio(-v), 0, 1e-4);
  EXPECT_NEAR(ratio(0), 1, 1e-12);
  EXPECT_LT(ratio(0.05), 2 + a);
  EXPECT_GT(maximum(free.T), 60);
}

TEST(NashPanfilov, FollowsItsEquation) {
  constexpr double v = 0.005, a = 0.35, lag = 10;
  for (const bool velocity : {false, true}) {
    const std::map<std::string, double> set = {{"shortening_per_ms", velocity ? v : 0.0}};
    const std::function<std::array<double, 2>(double, const std::array<double, 2>&)> rate =
        [](double t, const auto& y) {
          const double V = (potential(t) + 80) / 100;
          const double e = 0.01 + 0.09 * std::exp(-std::exp(-100 * (V - 0.05)));
          return std::array<double, 2>{e * (47.9 * V - y[0]), (breathing_rate(t) - y[1]) / lag};
        };
    const auto tension = [&](double t, const auto& y) {
      return y[0] * (1 + 1.45 * (breathing(t) - 1)) * (velocity ? hill(y[1], v, a) : 1);
    };
    double before = 0;
    for (const double dt : {0.4, 0.2, 0.1}) {
      const double error = error_of<2>(
          run("nash_panfilov", {.drive = potential, .stretch = breathing}, dt, Precision::double_, set), 800,
          rate, tension);
      std::printf("| nash_panfilov%s | double, dt %.1f ms | error over peak | %.2e |\n",
                  velocity ? " with velocity" : "", dt, error);
      EXPECT_LT(error, 2e-3 * dt);
      if (before > 0) {
        EXPECT_LT(error, before / 3);
      }
      before = error;
    }
    const double single = error_of<2>(
        run("nash_panfilov", {.drive = potential, .stretch = breathing}, 0.1, Precision::single_, set), 800,
        rate, tension);
    EXPECT_LT(single, 2e-4);
  }
  // A potential held: T = kT V, approached by exp(-t / 10 ms); a step of 80 ms is as good as many.
  const Course held = {.drive = [](double) { return 20.0; }, .end_ms = 80};
  EXPECT_NEAR(run("nash_panfilov", held, 0.1).T.back(), 47.9 * (1 - std::exp(-8.0)), 1e-9);
  EXPECT_NEAR(run("nash_panfilov", held, 80).T.back(), 47.9 * (1 - std::exp(-8.0)), 1e-9);
}

// Land et al. 2017 as the paper has it, y = troponin, B, W, S, z_w, z_s; B is 1 at rest, so 1 - B stands in
// y.
std::array<double, 6> land(double Ca_uM, double stretch, double stretch_rate,
                           const std::array<double, 6>& y) {
  constexpr double k_trpn = 0.1, n_trpn = 2, trpn_50 = 0.35, n_tm = 5, k_u = 1, k_uw = 0.182, k_ws = 0.012,
                   r_w = 0.5, r_s = 0.25, gamma_w = 0.615, gamma_s = 0.0085, phi = 2.23, A_eff = 25;
  const double Ca50 = 0.805 - 2.4 * (std::min(stretch, 1.2) - 1), B = 1 - y[1], W = y[2], S = y[3],
               U = 1 - B - W - S;
  const double k_b = k_u * std::pow(trpn_50, n_tm) / (1 - r_s - (1 - r_s) * r_w);
  const double k_wu = k_uw * (1 / r_w - 1) - k_ws, k_su = k_ws * r_w * (1 / r_s - 1);
  const double A = A_eff * r_s / ((1 - r_s) * r_w + r_s);
  const double c_w = phi * k_uw * ((1 - r_s) * (1 - r_w)) / ((1 - r_s) * r_w),
               c_s = phi * k_ws * ((1 - r_s) * r_w) / r_s;
  const double gamma_su = gamma_s * (y[5] > 0 ? y[5] : y[5] < -1 ? -y[5] - 1 : 0);
  const double blocking = y[0] > 0 ? std::min(std::pow(y[0], -n_tm / 2), 100.0) : 100;
  return {k_trpn * (std::pow(Ca_uM / Ca50, n_trpn) * (1 - y[0]) - y[0]),
          -(k_b * blocking * U - k_u * std::pow(y[0], n_tm / 2) * B),
          k_uw * U - k_wu * W - k_ws * W - gamma_w * std::abs(y[4]) * W,
          k_ws * W - k_su * S - gamma_su * S,
          A * stretch_rate - c_w * y[4],
          A * stretch_rate - c_s * y[5]};
}
double land_tension(double stretch, const std::array<double, 6>& y) {
  const double l = std::min(stretch, 1.2), h = std::max(0.0, 1 + 2.3 * (l + std::min(l, 0.87) - 1.87));
  return h * 120 / 0.25 * ((y[5] + 1) * y[3] + y[4] * y[2]);
}

TEST(Calcium, FollowsItsEquations) {
  for (const bool moving : {false, true}) {
    const Function stretch = moving ? Function(breathing) : Function([](double) { return 1.0; });
    const auto rate = [&](double t, const std::array<double, 6>& y) {
      return land(1000 * calcium(t), stretch(t), moving ? breathing_rate(t) : 0, y);
    };
    double before = 0;
    for (const double dt : {0.4, 0.2, 0.1}) {
      const Series series = run("calcium", {.drive = calcium, .stretch = stretch}, dt);
      const double error = error_of<6>(series, 800, rate,
                                       [&](double t, const auto& y) { return land_tension(stretch(t), y); });
      std::printf(
          "| calcium%s | double, dt %.1f ms | peak %.1f kPa at %.0f ms, error over peak | %.2e |\n",
          moving ? ", moving" : "", dt, maximum(series.T),
          static_cast<double>(std::max_element(series.T.begin(), series.T.end()) - series.T.begin() + 1) * dt,
          error);
      EXPECT_LT(error, 5e-3 * dt);
      if (before > 0) {
        EXPECT_LT(error, before / 3);
      }
      before = error;
    }
    const double single =
        error_of<6>(run("calcium", {.drive = calcium, .stretch = stretch}, 0.1, Precision::single_), 800,
                    rate, [&](double t, const auto& y) { return land_tension(stretch(t), y); });
    EXPECT_LT(single, 1e-3);
  }
}

// Held calcium: troponin x / (1 + x), W = U r_w / (1 - r_w), S = W / (r_w (1/r_s - 1)), B = U k_b/k_u
// R^-n_Tm. With the paper's numbers T = T_ref / (1 + B/(1 - B)), T_ref once saturated but for 0.6 %.
TEST(Calcium, HasItsSteadyState) {
  for (const double Ca : {0.3, 0.6, 0.8, 1.0, 2.0, 100.0}) {
    const double x = std::pow(Ca / 0.805, 2), R = x / (1 + x);
    const double B_over_U =
        std::pow(0.35, 5) / 0.375 * std::min(std::pow(R, -2.5), 100.0) * std::pow(R, -2.5);
    const double U = 1 / (B_over_U + 1 + 1 + 1 / 1.5);
    const double expected = 120 / 0.25 * U / 1.5;
    for (const double dt : {0.5, 20.0}) {
      const Series series = run("calcium", {.drive = [Ca](double) { return 1e-3 * Ca; }, .end_ms = 6000}, dt);
      EXPECT_NEAR(series.T.back(), expected, 1e-3 * expected + 1e-4) << Ca << " uM, steps of " << dt;
    }
    std::printf("| calcium | steady tension at %.1f uM, kPa | %.2f |\n", Ca, expected);
  }
}

// Steps far beyond every time constant, wild stretches: states stay shares, tension finite.
TEST(Tensions, AreStableWithAnyStep) {
  for (const std::string& tension : tensions())
    for (const double dt : {1.0, 20.0, 200.0}) {
      const Course wild = {.drive =
                               [&](double t) {
                                 return tension == "calcium" ? calcium(std::fmod(t, 800))
                                                             : potential(std::fmod(t, 800));
                               },
                           .stretch = [](double t) { return 1 + 0.5 * std::sin(t); },
                           .beat_ms = 800,
                           .end_ms = 8000};
      const Series series = run(tension, wild, dt, Precision::single_,
                                tension == "twitch" || tension == "nash_panfilov"
                                    ? std::map<std::string, double>{{"shortening_per_ms", 0.005}}
                                    : std::map<std::string, double>{});
      for (const double T : series.T)
        EXPECT_TRUE(std::isfinite(T) && std::abs(T) < 1e4) << tension << " " << dt;
      if (tension == "calcium")
        for (std::size_t k = 0; k < 4; ++k) {
          EXPECT_GE(series.last[k], 0);
          EXPECT_LE(series.last[k], 1);
        }
    }
}

// tension_stiffness is at least what a sudden stretch adds to the active stress: lambda dS/dlambda without
// the fall of 1 / lambda^2, and not ten times as much.
TEST(Tensions, BoundTheirStiffness) {
  for (const std::string& tension : tensions()) {
    const std::map<std::string, double> set =
        tension == "twitch" || tension == "nash_panfilov"
            ? std::map<std::string, double>{{"shortening_per_ms", 0.005}, {"velocity_lag_ms", 20}}
            : std::map<std::string, double>{};
    constexpr double at = 200, dt = 0.02, jump = 1e-4;
    for (const double stretch : {0.9, 1.0, 1.1}) {
      Course course = {.drive = [&](double t) { return tension == "calcium" ? calcium(t) : potential(t); },
                       .stretch = [=](double) { return stretch; },
                       .end_ms = at};
      const double rest = run(tension, course, dt, Precision::double_, set).T.back();
      double most = 0, bound = 0;
      for (const double sign : {1.0, -1.0}) {
        course.stretch = [=](double t) { return t > at - dt / 2 ? stretch + sign * jump : stretch; };
        const Series jumped = run(tension, course, dt, Precision::double_, set);
        const double slope = (jumped.T.back() - rest) / (sign * jump);
        most = std::max(most, read_tension(tension).per_stretch2 ? slope / stretch : slope * stretch);
        bound = std::max(bound, jumped.last.back());
      }
      std::printf("| %s | stretch %.1f, T %.1f kPa | stiffness of a sudden stretch %.0f kPa, bound %.0f |\n",
                  tension.c_str(), stretch, rest, most, bound);
      EXPECT_GE(bound, most * 0.99 - 1e-9);
      EXPECT_LE(bound, most * 2 + 1e-9);
    }
  }
}

TEST(Constant, RisesToItsPeak) {
  EXPECT_EQ(run("constant", {.activation_ms = 10, .end_ms = 20}, 0.5).at(9.5), 0);
  EXPECT_EQ(run("constant", {.activation_ms = 10, .end_ms = 20}, 0.5).at(10), 60);
  const Series ramp = run("constant", {.end_ms = 20}, 0.5, Precision::double_, {{"ramp_ms", 10}});
  EXPECT_NEAR(ramp.at(5), 30, 1e-12);
  EXPECT_EQ(ramp.at(15), 60);
}

}  // namespace
}  // namespace cohort::test
