// The passive laws of kernels/laws, evaluated by the kernels themselves, against closed forms of their
// papers; and what the host knows of their stability at rest.
#include <cstdio>

#include "tests/laws.hpp"

namespace cohort::test {
namespace {

LawAnswer answer(const std::string& law, const std::map<std::string, double>& set, const PointState& state) {
  const Scene scene = solid_box(law);
  return evaluate_law(scene, Precision::double_, solid_values(scene, set), {state})[0];
}

// Of an incompressible bar: Cauchy stress along less that across, F S F^T with J = 1.
double uniaxial(const std::string& law, const std::map<std::string, double>& set, double stretch) {
  const double across = 1 / std::sqrt(stretch);
  const LawAnswer a = answer(
      law, set, {.F = {{{stretch, 0, 0}, {0, across, 0}, {0, 0, across}}}, .f = {1, 0, 0}, .s = {0, 1, 0}});
  return stretch * stretch * a.S[0] - across * across * a.S[1];
}

// Simple shear F = I + gamma e_x (x) e_y: Cauchy stress sigma_xy.
double shear(const std::string& law, const std::map<std::string, double>& set, double gamma, const Vector& f,
             const Vector& s) {
  const LawAnswer a = answer(law, set, {.F = {{{1, gamma, 0}, {0, 1, 0}, {0, 0, 1}}}, .f = f, .s = s});
  return a.S[5] + gamma * a.S[1];
}

// Rivlin 1948, part IV: sigma = 2 (c1 + c2 / lambda) (lambda^2 - 1 / lambda), and 2 (c1 + c2) gamma in shear.
TEST(ClosedForms, MooneyRivlinAndNeoHookean) {
  const std::map<std::string, double> c = {{"c1_kPa", 1.7}, {"c2_kPa", 0.4}};
  for (const double l : {0.5, 0.9, 1.0, 1.3, 2.0}) {
    EXPECT_NEAR(uniaxial("mooney_rivlin", c, l), 2 * (1.7 + 0.4 / l) * (l * l - 1 / l), 1e-12);
    EXPECT_NEAR(uniaxial("neo_hookean", {{"mu_kPa", 3}}, l), 3 * (l * l - 1 / l), 1e-12);
  }
  for (const double gamma : {-0.4, 0.1, 0.8}) {
    EXPECT_NEAR(shear("mooney_rivlin", c, gamma, {1, 0, 0}, {0, 1, 0}), 2 * (1.7 + 0.4) * gamma, 1e-12);
    EXPECT_NEAR(shear("neo_hookean", {{"mu_kPa", 3}}, gamma, {1, 0, 0}, {0, 1, 0}), 3 * gamma, 1e-12);
  }
}

// Ogden 1972, eq. 24: sigma = sum mu (lambda^alpha - lambda^(-alpha/2)). His data for rubber (Treloar's) at a
// stretch of 2 and 7: nominal stress about 0.55 and 3.7 N/mm2... is met by the formula itself, so only the
// formula is compared.
TEST(ClosedForms, Ogden) {
  const std::array<std::pair<double, double>, 3> terms = {{{630, 1.3}, {1.2, 5}, {-10, -2}}};
  const std::map<std::string, double> rubber = {{"mu1_kPa", 630}, {"mu2_kPa", 1.2}, {"mu3_kPa", -10}};
  for (const double l : {0.6, 1.0, 1.5, 2.0, 5.0}) {
    double expected = 0;
    for (const auto& [mu, alpha] : terms) expected += mu * (std::pow(l, alpha) - std::pow(l, -alpha / 2));
    EXPECT_NEAR(uniaxial("ogden", rubber, l), expected, 1e-11 * (1 + std::abs(expected))) << l;
  }
}

// Ogden's law with one term of exponent 2, and with 2 and -2, is neo-Hookean and Mooney-Rivlin; everywhere,
// where no two stretches are equal and where two or three are.
TEST(ClosedForms, OgdenHoldsMooneyRivlin) {
  const Scene ogden = solid_box("ogden"), rivlin = solid_box("mooney_rivlin");
  const std::vector<double> a = solid_values(ogden, {{"mu1_kPa", 3.4},
                                                     {"alpha1", 2},
                                                     {"mu2_kPa", -0.8},
                                                     {"alpha2", -2},
                                                     {"mu3_kPa", 0},
                                                     {"alpha3", 1}}),
                            b = solid_values(rivlin, {{"c1_kPa", 1.7}, {"c2_kPa", 0.4}});
  std::mt19937_64 random(7);
  std::vector<PointState> states;
  while (states.size() < 40) {
    const PointState state = random_state(random, 0.5, 1.8);
    // Below, J^(-1/3) fades and the invariants are those of no unimodular tensor.
    if (determinant(state.F) > 0.3) states.push_back(state);
  }
  for (const double apart : {0.0, 1e-12, 1e-8, 1e-5, 1e-3}) {
    const Matrix turn = random_rotation(random);
    for (const Matrix& stretch : {Matrix{{{1.2 + apart, 0, 0}, {0, 1.2, 0}, {0, 0, 0.7}}},
                                  Matrix{{{0.9 + apart, 0, 0}, {0, 0.9, 0}, {0, 0, 0.9 - apart}}}})
      states.push_back({times(stretch, turn), {1, 0, 0}, {0, 1, 0}});
  }
  for (const auto& [precision, tolerance] :
       {std::pair{Precision::double_, 1e-12}, {Precision::single_, 2e-5}}) {
    const std::vector<LawAnswer> first = evaluate_law(ogden, precision, a, states),
                                 second = evaluate_law(rivlin, precision, b, states);
    for (std::size_t i = 0; i < states.size(); ++i) {
      for (std::size_t c = 0; c < 6; ++c)
        EXPECT_NEAR(first[i].S[c], second[i].S[c], tolerance * (10 + largest(second[i].S))) << i;
      // Quotients of nearly equal stretches are derivatives.
      EXPECT_NEAR(first[i].stiffness, second[i].stiffness,
                  std::max(1e-6, 100 * tolerance) * second[i].stiffness)
          << i;
    }
  }
}

TEST(ClosedForms, StVenantKirchhoff) {
  const std::map<std::string, double> p = {{"lambda_kPa", 5}, {"mu_kPa", 2}};
  for (const double l : {0.4, 0.9, 1.5}) {
    const LawAnswer a =
        answer("st_venant_kirchhoff", p, {.F = {{{l, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, .f = {}, .s = {}});
    const double E = (l * l - 1) / 2;
    EXPECT_NEAR(a.S[0], (5 + 2 * 2) * E, 1e-13);
    EXPECT_NEAR(a.S[1], 5 * E, 1e-13);
  }
  // Under compression the force of a confined bar is largest at a stretch of 1/sqrt 3, and falls beyond.
  const auto force = [&](double l) {
    return l * answer("st_venant_kirchhoff", p, {.F = {{{l, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, .f = {}, .s = {}})
                   .S[0];
  };
  const double turn = 1 / std::sqrt(3.0);
  EXPECT_LT(force(turn), force(turn + 0.02));
  EXPECT_LT(force(turn), force(turn - 0.02));
}

// Guccione's law in a bar along the fibre: S_ff = C bf E exp(Q), and across, from eq. 2.2 of Land et al. by
// hand.
TEST(ClosedForms, Guccione) {
  const std::map<std::string, double> p = {{"C_kPa", 2}, {"bf", 8}, {"bt", 2}, {"bfs", 4}};
  for (const double l : {0.8, 1.1, 1.3}) {
    const double a = 1 / std::sqrt(l), E = (l * l - 1) / 2, T = (a * a - 1) / 2;
    const double e = std::exp(8 * E * E + 2 * (2 * T * T));
    EXPECT_NEAR(uniaxial("guccione", p, l), l * l * 2 * 8 * E * e - a * a * 2 * 2 * T * e, 1e-12 * e);
  }
  // Shear between x and y: E_xy = gamma/2, E_yy = gamma^2/2; fibres along x, then along z.
  for (const double gamma : {0.1, 0.5}) {
    const double xy = gamma / 2, yy = gamma * gamma / 2;
    double e = 2 * std::exp(2 * yy * yy + 4 * 2 * xy * xy);
    EXPECT_NEAR(shear("guccione", p, gamma, {1, 0, 0}, {0, 1, 0}), e * (4 * xy + gamma * 2 * yy), 1e-13 * e);
    e = 2 * std::exp(2 * yy * yy + 2 * 2 * xy * xy);
    EXPECT_NEAR(shear("guccione", p, gamma, {0, 0, 1}, {0, 1, 0}), e * (2 * xy + gamma * 2 * yy), 1e-13 * e);
  }
}

// Holzapfel & Ogden 2009, section 5: shears of myocardium, sigma = 2 (psi_1 + psi_4) gamma + psi_8 with the
// fibre (or sheet) that is sheared lengthened to I4 = 1 + gamma^2; nothing but the ground substance where
// neither is. The paper's step is sharp: its smooth form is whole to 1e-6 at gamma = 0.4.
TEST(ClosedForms, HolzapfelOgden) {
  const double gamma = 0.4, g2 = gamma * gamma;
  const double psi_1 = 0.059 / 2 * std::exp(8.023 * g2);
  const double psi_f = 18.472 * g2 * std::exp(16.026 * g2 * g2),
               psi_s = 2.481 * g2 * std::exp(11.12 * g2 * g2);
  const double psi_8 = 0.216 * gamma * std::exp(11.436 * g2);
  const Vector x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
  const auto expect = [&](const Vector& f, const Vector& s, double expected) {
    EXPECT_NEAR(shear("holzapfel_ogden", {}, gamma, f, s), expected, 1e-5 * expected);
  };
  expect(y, x, 2 * (psi_1 + psi_f) * gamma + psi_8);
  expect(x, y, 2 * (psi_1 + psi_s) * gamma + psi_8);
  expect(y, z, 2 * (psi_1 + psi_f) * gamma);
  expect(z, y, 2 * (psi_1 + psi_s) * gamma);
  expect(x, z, 2 * psi_1 * gamma);
  expect(z, x, 2 * psi_1 * gamma);
}

// The benchmark's volumetric pressure: kappa/2 (J - 1/J), its tangent below J = 0.1; against kappa (J - 1) it
// differs by a share (J - 1)/(2 J).
TEST(ClosedForms, HolzapfelOgdenPressure) {
  const Scene scene = solid_box("holzapfel_ogden");
  const std::vector<double> J = {-0.5, 0.0999, 0.1001, 0.5, 0.95, 1, 1.05, 2};
  const std::vector<double> p =
      run_solid(scene, Precision::double_, R"(
kernel void pressure(global const real *P, global const real *in, global real *out, const int count) {
  const int i = get_global_id(0);
  if (i < count) out[i] = law_pressure(in[i], 1000);
}
)",
                "pressure", solid_values(scene, {}), J, J.size(), static_cast<int>(J.size()));
  for (std::size_t i = 2; i < J.size(); ++i) {
    EXPECT_NEAR(p[i], 500 * (J[i] - 1 / J[i]), 1e-9);
    EXPECT_NEAR(p[i], 1000 * (J[i] - 1) * (1 - (J[i] - 1) / (2 * J[i])), 1e-9);
  }
  // The energy's derivative.
  const std::vector<double> slope =
      run_solid(scene, Precision::double_, R"(
kernel void slope(global const real *P, global const real *in, global real *out, const int count) {
  const int i = get_global_id(0);
  const real h = 1e-5;
  if (i < count) out[i] = (law_volume_energy(in[i] + h, 1000) - law_volume_energy(in[i] - h, 1000)) / (2 * h);
}
)",
                "slope", solid_values(scene, {}), J, J.size(), static_cast<int>(J.size()));
  for (std::size_t i = 0; i < J.size(); ++i)
    EXPECT_NEAR(slope[i], p[i], 1e-6 * std::abs(p[i]) + 1e-5) << J[i];
  EXPECT_NEAR(p[2] - p[1], 500 * 0.0002 * 101, 0.01);
  EXPECT_NEAR(p[0], 500 * (0.1 - 10) - 500 * 0.6 * 101, 1e-9);
}

// ---- Parameters that make no stable solid ----

TEST(Stability, NamesUnstableParameters) {
  const auto defect = [](const std::string& law, const std::map<std::string, double>& set) {
    const Scene scene = solid_box(law);
    return law_defect(scene, solid_values(scene, set));
  };
  for (const std::string& law : laws()) EXPECT_EQ(defect(law, {}), "") << law;
  const auto expect = [&](const std::string& law, const std::map<std::string, double>& set,
                          const std::string& part) {
    EXPECT_NE(defect(law, set).find(part), std::string::npos) << law << ": " << defect(law, set);
  };
  expect("mooney_rivlin", {{"c1_kPa", 0.5}, {"c2_kPa", -0.7}}, "2 (c1_kPa + c2_kPa), is -0.4 kPa");
  EXPECT_EQ(defect("mooney_rivlin", {{"c1_kPa", 0.5}, {"c2_kPa", -0.3}}), "");
  EXPECT_EQ(defect("ogden", {{"mu1_kPa", -0.5}}), "");
  expect("ogden", {{"mu1_kPa", -100}}, "mu3_kPa alpha3, is -64.3875 kPa");
  expect("guccione", {{"C_kPa", 0}}, "unstable at rest");
  expect("guccione", {{"C_kPa", -1}}, "unstable at rest");
  expect("neo_hookean", {{"mu_kPa", -1}}, "is -1 kPa");
  expect("holzapfel_ogden", {{"a_kPa", -1}}, "unstable at rest");
  expect("st_venant_kirchhoff", {{"lambda_kPa", -400}}, "change of volume");
  expect("neo_hookean", {{"bulk_modulus_kPa", -1}}, "bulk modulus");
}

// What law_defect knows of the laws in closed form is the kernels': along each small change of shape h e the
// energy grows by h^2/2 e:D:e, nowhere less than the least stiffness and somewhere hardly more. With random
// parameters.
TEST(Stability, KnowsTheKernelsTangents) {
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> factor(0.3, 3);
  for (const std::string& law : laws()) {
    const Scene scene = solid_box(law);
    std::map<std::string, double> set;
    for (const Parameter& p : read_law(law).parameters) set[p.path] = p.value * factor(random);
    const std::vector<double> values = solid_values(scene, set);
    std::vector<PointState> states;
    constexpr double h = 1e-4;
    for (int i = 0; i < 3000; ++i) {
      Matrix e{};
      double norm = 0;
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c <= r; ++c) e[r][c] = e[c][r] = normal(random);
      const double mean = (e[0][0] + e[1][1] + e[2][2]) / 3;
      for (std::size_t r = 0; r < 3; ++r) e[r][r] -= mean;
      for (const Vector& row : e)
        for (const double x : row) norm += x * x;
      PointState state;
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 3; ++c) state.F[r][c] += h * e[r][c] / std::sqrt(norm);
      states.push_back(state);
    }
    double sampled = 1e300;
    for (const LawAnswer& a : evaluate_law(scene, Precision::double_, values, states))
      sampled = std::min(sampled, 2 * a.W / (h * h));
    const double least = least_stiffness_at_rest(scene, values, 0);
    std::printf("| %s | double | least stiffness of shape at rest, kPa: %.4g, sampled %.4g |\n", law.c_str(),
                least, sampled);
    EXPECT_GT(least, 0);
    EXPECT_GT(sampled, 0.995 * least);
    EXPECT_LT(sampled, 1.15 * least);
  }
}

}  // namespace
}  // namespace cohort::test
