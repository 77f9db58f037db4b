// The passive laws of kernels/laws, evaluated by the kernels themselves: against energies differentiated
// elsewhere (tests/reference/laws.csv), and for what must hold of any hyperelastic solid.
#include "tests/laws.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>

namespace cohort::test {
namespace {

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

}  // namespace
}  // namespace cohort::test
