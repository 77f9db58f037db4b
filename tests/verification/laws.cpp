// The passive laws of kernels/laws, evaluated by the kernels themselves: against energies differentiated
// elsewhere (tests/reference/laws.csv), closed forms of the papers, and what must hold of any hyperelastic
// solid.
#include "tests/laws.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>

namespace cohort::test {
namespace {

Matrix random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  double q[4], length = 0;
  for (double& x : q) {
    x = normal(random);
    length += x * x;
  }
  for (double& x : q) x /= std::sqrt(length);
  const auto [w, x, y, z] = std::array{q[0], q[1], q[2], q[3]};
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

// R1 diag(stretches) R2 with a random pair of fibre and sheet.
PointState random_state(std::mt19937_64& random, double least, double most) {
  std::uniform_real_distribution<double> logarithm(std::log(least), std::log(most));
  Matrix stretch{};
  for (std::size_t i = 0; i < 3; ++i) stretch[i][i] = std::exp(logarithm(random));
  const Matrix frame = random_rotation(random);
  return {times(random_rotation(random), times(stretch, random_rotation(random))), frame[0], frame[1]};
}

double largest(const std::array<double, 6>& S) {
  double result = 0;
  for (const double x : S) result = std::max(result, std::abs(x));
  return result;
}

class Laws : public testing::TestWithParam<std::string> {
 protected:
  Laws() : scene(solid_box(GetParam())), values(solid_values(scene, {})) {}
  std::vector<LawAnswer> evaluate(const std::vector<PointState>& states,
                                  Precision precision = Precision::double_) const {
    return evaluate_law(scene, precision, values, states);
  }
  Scene scene;
  std::vector<double> values;
};

TEST_P(Laws, GiveTheStressesOfTheirPapersEnergies) {
  std::ifstream file(COHORT_SOURCE_DIR "/tests/reference/laws.csv");
  std::vector<PointState> states;
  std::vector<std::array<double, 6>> expected;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(GetParam() + ",")) continue;
    std::istringstream words(line.substr(GetParam().size() + 1));
    std::vector<double> x;
    for (std::string word; std::getline(words, word, ',');) x.push_back(std::stod(word));
    ASSERT_EQ(x.size(), 21u);
    PointState state;
    for (std::size_t i = 0; i < 9; ++i) state.F[i / 3][i % 3] = x[i];
    for (std::size_t i = 0; i < 3; ++i) {
      state.f[i] = x[9 + i];
      state.s[i] = x[12 + i];
    }
    states.push_back(state);
    expected.emplace_back();
    std::copy(x.begin() + 15, x.end(), expected.back().begin());
  }
  ASSERT_EQ(states.size(), 4u);
  for (const auto& [precision, tolerance] :
       {std::pair{Precision::double_, 1e-10}, {Precision::single_, 2e-4}}) {
    const std::vector<LawAnswer> found = evaluate(states, precision);
    double worst = 0;
    for (std::size_t i = 0; i < states.size(); ++i)
      for (std::size_t c = 0; c < 6; ++c)
        worst = std::max(worst, std::abs(found[i].S[c] - expected[i][c]) / largest(expected[i]));
    std::printf("| %s | %s | stress against the paper's energy | %.1e |\n", GetParam().c_str(),
                precision == Precision::double_ ? "double" : "single", worst);
    EXPECT_LT(worst, tolerance);
  }
}

// dW/dF = F S by central differences; also where the volumetric part of isochoric laws fades (J from 0.1 to
// 0.3), and for inverted points.
TEST_P(Laws, HaveStressesThatBelongToTheirEnergy) {
  std::mt19937_64 random(1);
  std::vector<PointState> base;
  for (int i = 0; i < 200; ++i) base.push_back(random_state(random, 0.7, 1.4));
  for (int i = 0; i < 100; ++i) base.push_back(random_state(random, 0.4, 1.0));
  const bool finite_when_inverted = GetParam() != "ogden";  // its powers of tiny stretches are floored
  for (int i = 0; i < 20 && finite_when_inverted; ++i) {
    base.push_back(random_state(random, 0.7, 1.2));
    for (double& x : base.back().F[0]) x = -x;
  }
  constexpr double h = 1e-5;
  std::vector<PointState> states = base;
  for (const PointState& state : base)
    for (std::size_t e = 0; e < 9; ++e)
      for (const double sign : {1.0, -1.0}) {
        states.push_back(state);
        states.back().F[e / 3][e % 3] += sign * h;
      }
  const std::vector<LawAnswer> found = evaluate(states);
  double worst = 0;
  int faded = 0;
  for (std::size_t i = 0; i < base.size(); ++i) {
    const double J = determinant(base[i].F);
    faded += J > 0.1 && J < 0.3;
    const Matrix P = times(base[i].F, full(found[i].S));
    double scale = std::abs(found[i].W);
    for (const Vector& row : P)
      for (const double x : row) scale = std::max(scale, std::abs(x));
    for (std::size_t e = 0; e < 9; ++e) {
      const std::size_t at = base.size() + 18 * i + 2 * e;
      const double slope = (found[at].W - found[at + 1].W) / (2 * h);
      worst = std::max(worst, std::abs(slope - P[e / 3][e % 3]) / scale);
    }
  }
  std::printf(
      "| %s | double | stress against differences of the energy, %zu states, %d of them fading | %.1e |\n",
      GetParam().c_str(), base.size(), faded, worst);
  EXPECT_GT(faded, 10);
  EXPECT_LT(worst, 1e-6);
}

TEST_P(Laws, AreAtRestWithoutStress) {
  std::mt19937_64 random(2);
  std::vector<PointState> states;
  for (int i = 0; i < 50; ++i) {
    states.push_back(random_state(random, 1, 1));
    states.emplace_back();
  }
  for (const Precision precision : {Precision::double_, Precision::single_}) {
    const std::vector<LawAnswer> found = evaluate(states, precision);
    // Rotations are rounded, and so is the pressure that isochoric laws take away: E is some roundings, S
    // that times the stiffness.
    const double unit = precision == Precision::double_ ? 1e-14 : 1e-5;
    const double rounding = precision == Precision::double_ ? 4e-16 : 2e-7;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const bool unturned = i % 2 == 1;
      EXPECT_LE(largest(found[i].S), (unturned ? rounding : unit) * found[i].stiffness);
      EXPECT_LE(std::abs(found[i].W), unit * found[i].stiffness);
      EXPECT_GT(found[i].stiffness, 0);
    }
  }
}

// A rotation of the body as it is changes neither S nor W; one of body, fibres and sheets before turns S with
// it.
TEST_P(Laws, AreFrameIndifferent) {
  std::mt19937_64 random(3);
  std::vector<PointState> states;
  std::vector<Matrix> turns;
  for (int i = 0; i < 50; ++i) {
    const PointState state = random_state(random, 0.7, 1.4);
    const Matrix after = random_rotation(random), before = random_rotation(random);
    turns.push_back(before);
    states.push_back(state);
    states.push_back({times(after, state.F), state.f, state.s});
    states.push_back({times(state.F, transposed(before)), times(before, state.f), times(before, state.s)});
  }
  const std::vector<LawAnswer> found = evaluate(states);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const LawAnswer &a = found[3 * i], &rotated = found[3 * i + 1], &turned = found[3 * i + 2];
    const double tolerance = 1e-11 * std::max(largest(a.S), 1.0);
    const Matrix back = times(transposed(turns[i]), times(full(turned.S), turns[i])), S = full(a.S);
    for (std::size_t c = 0; c < 6; ++c) EXPECT_NEAR(a.S[c], rotated.S[c], tolerance);
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(S[r][c], back[r][c], tolerance);
    EXPECT_NEAR(a.W, rotated.W, 1e-11 * (1 + std::abs(a.W)));
    EXPECT_NEAR(a.W, turned.W, 1e-11 * (1 + std::abs(a.W)));
  }
}

// What fibres and sheets do: nothing in isotropic laws, sheets nothing in Guccione's, all in Holzapfel and
// Ogden's.
TEST_P(Laws, HaveTheSymmetryOfTheirPaper) {
  std::mt19937_64 random(4);
  const bool fibres = GetParam() == "guccione" || GetParam() == "holzapfel_ogden";
  const bool sheets = GetParam() == "holzapfel_ogden";
  EXPECT_EQ(read_law(GetParam()).sheets, sheets);
  double by_fibres = 0, by_sheets = 0;
  for (int i = 0; i < 20; ++i) {
    const PointState state = random_state(random, 0.8, 1.25);
    PointState turned = state, other = random_state(random, 1, 1);
    other.F = state.F;
    const Vector n = {state.f[1] * state.s[2] - state.f[2] * state.s[1],
                      state.f[2] * state.s[0] - state.f[0] * state.s[2],
                      state.f[0] * state.s[1] - state.f[1] * state.s[0]};
    const double angle = 1.1;
    for (std::size_t c = 0; c < 3; ++c) turned.s[c] = std::cos(angle) * state.s[c] + std::sin(angle) * n[c];
    const std::vector<LawAnswer> found = evaluate({state, turned, other});
    const double scale = std::max(largest(found[0].S), 1e-3);
    for (std::size_t c = 0; c < 6; ++c) {
      by_sheets = std::max(by_sheets, std::abs(found[0].S[c] - found[1].S[c]) / scale);
      by_fibres = std::max(by_fibres, std::abs(found[0].S[c] - found[2].S[c]) / scale);
    }
  }
  if (sheets)
    EXPECT_GT(by_sheets, 0.01);
  else
    EXPECT_LT(by_sheets, 1e-13);
  if (fibres)
    EXPECT_GT(by_fibres, 0.01);
  else
    EXPECT_LT(by_fibres, 1e-13);
}

// Largest H : D : H, H = sym(F^T m (x) N), of a state: D by differences of S, then ascent in m (an
// eigenvector) for many N and the best refined.
double acoustic_maximum(const Matrix& F, const std::array<std::array<double, 6>, 6>& D,
                        std::mt19937_64& random) {
  const auto value = [&](const Vector& N, Vector& m) {
    // A(m) = H:D:H is a quadratic form in m: columns from H of unit vectors.
    Matrix A{};
    std::array<std::array<double, 6>, 3> H{}, DH{};
    for (std::size_t u = 0; u < 3; ++u) {
      const Vector& a = F[u];  // F^T e_u
      H[u] = {a[0] * N[0],
              a[1] * N[1],
              a[2] * N[2],
              a[1] * N[2] + a[2] * N[1],
              a[0] * N[2] + a[2] * N[0],
              a[0] * N[1] + a[1] * N[0]};
      for (std::size_t p = 0; p < 6; ++p)
        for (std::size_t q = 0; q < 6; ++q) DH[u][p] += D[p][q] * H[u][q];
    }
    for (std::size_t u = 0; u < 3; ++u)
      for (std::size_t v = 0; v < 3; ++v)
        for (std::size_t p = 0; p < 6; ++p) A[u][v] += H[u][p] * DH[v][p];
    // Power iteration, shifted so that the largest eigenvalue has the largest size.
    double shift = 0;
    for (const Vector& row : A)
      for (const double x : row) shift += std::abs(x);
    for (int k = 0; k < 30; ++k) {
      Vector next = times(A, m);
      double length = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        next[c] += shift * m[c];
        length += next[c] * next[c];
      }
      for (std::size_t c = 0; c < 3; ++c) m[c] = next[c] / std::sqrt(length);
    }
    const Vector Am = times(A, m);
    return m[0] * Am[0] + m[1] * Am[1] + m[2] * Am[2];
  };
  const auto unit = [&](double spread, const Vector& around) {
    std::normal_distribution<double> normal;
    Vector v;
    double length = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      v[c] = around[c] + spread * normal(random);
      length += v[c] * v[c];
    }
    for (double& x : v) x /= std::sqrt(length);
    return v;
  };
  double best = -1e300;
  Vector N_best{};
  for (int k = 0; k < 120; ++k) {
    const Vector N = k < 60 ? unit(1, {0, 0, 0}) : unit(1 / (1 + 0.5 * (k - 60)), N_best);
    Vector m = unit(1, {0, 0, 0});
    const double found = value(N, m);
    if (found > best) {
      best = found;
      N_best = N;
    }
  }
  return best;
}

TEST_P(Laws, BoundTheStiffnessOfTheirAcousticTensor) {
  std::mt19937_64 random(5);
  std::vector<PointState> base = {PointState{}};
  for (int i = 0; i < 60; ++i) base.push_back(random_state(random, 0.8, 1.25));
  for (int i = 0; i < 60; ++i) base.push_back(random_state(random, 0.5, 1.6));
  for (int i = 0; i < 30; ++i) base.push_back(random_state(random, 0.3, 1.0));  // where isochoric laws fade
  // D = 2 dS/dC by central differences of S along dF = F^-T dC / 2, which changes C by dC to first order.
  constexpr double h = 1e-5;
  std::vector<PointState> states = base;
  for (const PointState& state : base) {
    const Matrix& F = state.F;
    const double J = determinant(F);
    Matrix inverse_transposed{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
        inverse_transposed[i][j] = (F[a][c] * F[b][d] - F[a][d] * F[b][c]) / J;
      }
    const std::array<std::array<std::size_t, 2>, 6> places = {
        {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};
    for (const auto& [r, c] : places)
      for (const double sign : {1.0, -1.0}) {
        Matrix dE{};
        dE[r][c] = dE[c][r] = r == c ? 1 : 0.5;
        const Matrix dF = times(inverse_transposed, dE);
        states.push_back(state);
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) states.back().F[i][j] += sign * h * dF[i][j];
      }
  }
  const std::vector<LawAnswer> found = evaluate(states);
  const std::vector<LawAnswer> single = evaluate(base, Precision::single_);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < base.size(); ++i) {
    std::array<std::array<double, 6>, 6> D{};
    for (std::size_t q = 0; q < 6; ++q)
      for (std::size_t p = 0; p < 6; ++p) {
        const std::size_t at = base.size() + 12 * i + 2 * q;
        // H enters by its six different components, shears twice.
        D[p][q] = (found[at].S[p] - found[at + 1].S[p]) / (2 * h);
      }
    const double exact = acoustic_maximum(base[i].F, D, random);
    EXPECT_GE(found[i].stiffness, exact * (1 - 1e-3)) << i << " J " << determinant(base[i].F);
    EXPECT_NEAR(single[i].stiffness, found[i].stiffness, 0.01 * found[i].stiffness);
    // Below J = 0.1 some acoustic tensors have no positive eigenvalue.
    if (exact > 1e-6 * found[i].stiffness || i < 121) ratios.push_back(found[i].stiffness / exact);
    if (i == 0)
      std::printf("| %s | double | stiffness at rest: bound %.4g kPa, exact %.4g |\n", GetParam().c_str(),
                  found[0].stiffness, exact);
  }
  const auto summary = [&](const char* what, std::ptrdiff_t first, std::ptrdiff_t last) {
    std::vector<double> part(ratios.begin() + first, ratios.begin() + last);
    std::sort(part.begin(), part.end());
    std::printf("| %s | double | bound over exact, %s: least %.3f, median %.3f, most %.3f |\n",
                GetParam().c_str(), what, part.front(), part[part.size() / 2], part.back());
    return part[part.size() / 2];
  };
  EXPECT_LT(summary("stretches 0.8 to 1.25", 1, 61), 1.5);
  EXPECT_LT(summary("stretches 0.5 to 1.6", 61, 121), 2.5);
  summary("stretches 0.3 to 1", 121, static_cast<std::ptrdiff_t>(ratios.size()));
}

// Stretches of 0.3 to 2 in all combinations, and inverted points, in single precision.
TEST_P(Laws, AreFiniteAtExtremes) {
  std::mt19937_64 random(6);
  std::vector<PointState> states;
  for (const double x : {0.3, 0.5, 1.0, 1.5, 2.0})
    for (const double y : {0.3, 0.5, 1.0, 1.5, 2.0})
      for (const double z : {-0.3, -1e-4, 0.0, 0.3, 1.0, 2.0}) {
        states.push_back(random_state(random, 1, 1));
        states.back().F = {{{x, 0, 0}, {0, y, 0}, {0, 0, z}}};
        states.push_back(states.back());
        states.back().F = times(random_rotation(random), states.back().F);
      }
  for (const Precision precision : {Precision::double_, Precision::single_})
    for (const LawAnswer& answer : evaluate(states, precision)) {
      for (const double x : answer.S) EXPECT_TRUE(std::isfinite(x));
      EXPECT_TRUE(std::isfinite(answer.W));
      EXPECT_TRUE(std::isfinite(answer.stiffness) && answer.stiffness >= 0);
    }
}

INSTANTIATE_TEST_SUITE_P(All, Laws, testing::ValuesIn(laws()), [](const auto& test) { return test.param; });

// ---- Closed forms ----

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
  for (const double l : {0.6, 1.0, 1.5, 2.0, 5.0}) {
    double expected = 0;
    for (const auto& [mu, alpha] : terms) expected += mu * (std::pow(l, alpha) - std::pow(l, -alpha / 2));
    EXPECT_NEAR(uniaxial("ogden", {}, l), expected, 1e-11 * (1 + std::abs(expected))) << l;
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
  EXPECT_EQ(defect("ogden", {{"mu1_kPa", -10}}), "");
  expect("ogden", {{"mu1_kPa", -100}}, "mu3_kPa alpha3, is -52 kPa");
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
