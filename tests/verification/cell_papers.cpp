// What the papers say of their models: fronts, restitution, action potentials; and how errors fall with the
// step.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "tests/cells.hpp"

namespace cohort::test {
namespace {

/// A cable and how it is stepped; lengths in mm, times in ms.
struct Cable {
  double D, threshold_mV, length = 20, h = 0.125, dt = 0.05;
  int substeps = 1;
};

// Speed of a plane front along a cable, mm/ms, over 8 mm that end 6 mm before its end.
double front_speed(const std::string& model, const CellParameters& parameters, const Cable& c) {
  const std::string root = "electrophysiology.";
  std::vector<std::pair<std::string, double>> set = {
      {root + "conductivity_longitudinal_mS_per_mm", 1.4 * c.D},
      {root + "conductivity_transverse_mS_per_mm", 1.4 * c.D},
      {"stimuli.end.duration_ms", 4},
      {"stimuli.end.amplitude_mV_per_ms", 40},
      {"stimuli.end.radius_mm", 2}};
  for (const auto& [name, value] : parameters) set.emplace_back(root + model + "." + name, value);
  Slab cable({c.length, c.h, c.h}, c.h, Precision::double_, model, set,
             {{"end", Stimulus::Kind::sphere, ""}});
  std::size_t first = 0, second = 0;
  cable.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    if (std::abs(p[0] - (c.length - 14)) < 0.51 * c.h) first = i;
    if (std::abs(p[0] - (c.length - 6)) < 0.51 * c.h) second = i;
  });
  cable.monodomain->initialise(*cable.tissue, cable.parameters, c.dt, c.substeps);
  std::array<double, 2> arrival{-1, -1}, before{-1000, -1000};
  for (int step = 0; arrival[1] < 0 && step * c.dt < 400; ++step) {
    cable.monodomain->advance(*cable.tissue, cable.parameters, step * c.dt, step == 0);
    const std::size_t k = arrival[0] < 0 ? 0 : 1;
    const double V = cable.read(cable.monodomain->potential(), 1, k == 0 ? first : second)[0];
    if (V >= c.threshold_mV) arrival[k] = (step + (c.threshold_mV - before[k]) / (V - before[k])) * c.dt;
    before[k] = V;
  }
  return 8 / (arrival[1] - arrival[0]);
}

// u_t = D u_xx + c u (u - a) (1 - u) has the front of speed sqrt(c D / 2) (1 - 2 a): Aliev-Panfilov and
// FitzHugh-Nagumo with their recovery frozen. The grid's part of the error is (h / width)^2 / 12 or so, 1 %
// at most here.
TEST(FrontsWithoutRecovery, HaveTheirExactSpeed) {
  constexpr double D = 0.1, tolerance = 0.01;
  {
    constexpr double c1 = 0.26, a = 0.13;
    const double exact = std::sqrt(c1 * D / 2) * (1 - 2 * a),
                 found = front_speed("fitzhugh_nagumo", {{"b_per_ms", 0}}, {D, -40});
    std::printf("| fitzhugh_nagumo | front without recovery, mm/ms | %.5f | %.5f (%+.2f %%) |\n", exact,
                found, 100 * (found / exact - 1));
    EXPECT_NEAR(found, exact, tolerance * exact);
  }
  {
    constexpr double k = 8, a = 0.15, unit = 12.9;
    const double exact = std::sqrt(k / unit * D / 2) * (1 - 2 * a),
                 found = front_speed("aliev_panfilov", {{"epsilon_0", 0}, {"mu_1", 0}}, {D, -40});
    std::printf("| aliev_panfilov | front without recovery, mm/ms | %.5f | %.5f (%+.2f %%) |\n", exact, found,
                100 * (found / exact - 1));
    EXPECT_NEAR(found, exact, tolerance * exact);
  }
}

// The paper names its parameter sets by the greatest slope of the dynamic restitution curve; the default set
// is that of slope 1.1 (table 2). Pacing quickens in steps of 5 ms, 30 beats each, until beats alternate.
// Tolerance: the published slope has two digits, and a slope between two cycle lengths is not the curve's.
TEST(TenTusscherPanfilov, DynamicRestitutionHasThePublishedSlope) {
  Launcher launcher(device(), Precision::double_);
  constexpr double dt = 0.05, interval = 0.5, rest = -85.5, published = 1.1, tolerance = 0.1;
  SingleCells cell(launcher, Precision::double_, "ten_tusscher_panfilov", 1);
  cell.initialise();
  std::vector<double> periods = {1000, 600, 500, 400, 350, 320};
  for (double period = 300; period > 200; period -= 5) periods.push_back(period);
  double steepest = 0, last_duration = 0, last_interval = 0, shortest = 0;
  for (const double period : periods) {
    const std::vector<SingleCells::Pacing> pacing = {{period, 1000, 0}};
    const SingleCells::Stimulus twice_threshold{1, 52};
    cell.pace(pacing, twice_threshold, 30 * period, dt, 30 * period);
    const SingleCells::Trace trace = cell.pace(pacing, twice_threshold, 2 * period, dt, interval);
    const auto beat = static_cast<std::size_t>(std::lround(period / interval));
    const double peak =
        *std::max_element(trace.V[0].begin(), trace.V[0].begin() + static_cast<std::ptrdiff_t>(beat));
    // The second beat against the interval before it; alternans of more than 10 ms ends the curve.
    const double level = rest + 0.1 * (peak - rest);
    const double before = duration(trace.V[0], 0, beat, level, interval);
    const double apd = duration(trace.V[0], beat, trace.V[0].size(), level, interval);
    if (before < 0 || apd < 0 || std::abs(apd - before) > 10) break;
    const double slope = (last_duration - apd) / (last_interval - (period - before));
    if (last_duration > 0) steepest = std::max(steepest, slope);
    last_duration = apd;
    last_interval = period - before;
    shortest = period;
  }
  std::printf(
      "| ten_tusscher_panfilov | steepest slope of dynamic restitution | %.1f | %.3f (stable down to %.0f "
      "ms) |\n",
      published, steepest, shortest);
  EXPECT_NEAR(steepest, published, tolerance);
  EXPECT_LT(shortest, 260);
}

// What the reaction's step costs a front: diffusion in four substeps, so that its own error is small beside
// it; a grid of 0.2 mm, the benchmark's diffusivity along fibres. Against steps of 0.0125 ms. Also what one
// step of explicit diffusion makes of it.
TEST(FrontsInTissue, HardlyFeelTheReactionsStep) {
  for (const std::string model : {"ten_tusscher_panfilov", "courtemanche"}) {
    const auto speed = [&](double dt, int substeps) {
      return front_speed(
          model, {},
          {.D = 0.0953, .threshold_mV = -20, .length = 16, .h = 0.2, .dt = dt, .substeps = substeps});
    };
    const double fine = speed(0.0125, 4);
    for (const double dt : {0.05, 0.025}) {
      const double reaction = speed(dt, 4) / fine - 1, both = speed(dt, 1) / fine - 1;
      std::printf("| %s | %.3f | %.4f | %+.2f %% | %+.2f %% |\n", model.c_str(), dt, fine, 100 * reaction,
                  100 * both);
      EXPECT_LT(std::abs(reaction), 0.01) << model << " " << dt;
    }
  }
}

// After 12 s of pacing at 1 Hz, as the paper reports it (so says a code that reproduces its figures and table
// 3): resting potential -81 mV, upstroke 216 V/s, duration about 300 ms.
TEST(Courtemanche, HasThePublishedActionPotential) {
  Launcher launcher(device(), Precision::double_);
  SingleCells cell(launcher, Precision::double_, "courtemanche", 1);
  cell.initialise();
  constexpr double dt = 0.01, period = 1000;
  constexpr int before = 11;
  const std::vector<SingleCells::Pacing> pacing = {{period, before, 0}};
  cell.pace(pacing, stimulus_of("courtemanche"), before * period, dt, period);
  const double rest = cell.potential()[0];
  const std::vector<double> V = cell.pace({{period, 1, 0}}, stimulus_of("courtemanche"), 600, dt, dt).V[0];
  const double peak = *std::max_element(V.begin(), V.end());
  double slope = 0;
  for (std::size_t i = 1; i < V.size(); ++i) slope = std::max(slope, (V[i] - V[i - 1]) / dt);
  const double apd = duration(V, 0, V.size(), rest + 0.1 * (peak - rest), dt);
  std::printf("| courtemanche | resting potential at 1 Hz, mV | -81 | %.2f |\n", rest);
  std::printf("| courtemanche | greatest dV/dt at 1 Hz, V/s | 216 | %.1f |\n", slope);
  std::printf("| courtemanche | APD90 at 1 Hz, ms | 300 | %.1f |\n", apd);
  EXPECT_NEAR(rest, -81, 0.5);
  EXPECT_NEAR(slope, 216, 0.02 * 216);
  EXPECT_NEAR(apd, 300, 10);
}

class CellModels : public testing::TestWithParam<std::string> {};

// One beat from rest with steps of 0.1 to 0.0125 ms against 0.0015625 ms: time at which V rises through 0 mV,
// greatest dV/dt over 0.1 ms, and APD90, in double precision.
TEST_P(CellModels, ErrorsFallWithTheStep) {
  Launcher launcher(device(), Precision::double_);
  const auto measure = [&](double dt) {
    SingleCells cell(launcher, Precision::double_, GetParam(), 1);
    cell.initialise();
    const double rest = cell.potential()[0];
    const auto stimulus = stimulus_of(GetParam());
    const std::vector<double> start = cell.pace({{1000, 1, 0}}, stimulus, 20, dt, 0.1).V[0];
    cell.initialise();
    const std::vector<double> V = cell.pace({{1000, 1, 0}}, stimulus, 600, dt, 0.5).V[0];
    const double threshold = GetParam() == "fitzhugh_nagumo" || GetParam() == "aliev_panfilov" ? -40 : 0;
    double rise = -1, slope = 0;
    for (std::size_t i = 1; i < start.size(); ++i) {
      slope = std::max(slope, (start[i] - start[i - 1]) / 0.1);
      if (rise < 0 && start[i] >= threshold)
        rise = 0.1 * (static_cast<double>(i - 1) + (threshold - start[i - 1]) / (start[i] - start[i - 1]));
    }
    const double peak = *std::max_element(start.begin(), start.end());
    return std::array<double, 3>{rise, slope, duration(V, 0, V.size(), rest + 0.1 * (peak - rest), 0.5)};
  };
  const auto exact = measure(0.0015625);
  std::printf("| %s | 0.0016 | %.4f | %.2f | %.3f |\n", GetParam().c_str(), exact[0], exact[1], exact[2]);
  for (const double dt : {0.1, 0.05, 0.025, 0.0125}) {
    const auto found = measure(dt);
    std::printf("| | %.4f | %+.4f | %+.2f %% | %+.3f |\n", dt, found[0] - exact[0],
                100 * (found[1] / exact[1] - 1), found[2] - exact[2]);
    if (dt <= 0.05) {
      EXPECT_NEAR(found[0], exact[0], 0.01);
      EXPECT_NEAR(found[1], exact[1], 0.02 * exact[1]);
      EXPECT_NEAR(found[2], exact[2], 1);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, CellModels,
                         testing::Values("fitzhugh_nagumo", "aliev_panfilov", "bueno_orovio",
                                         "ten_tusscher_panfilov", "courtemanche"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace cohort::test
