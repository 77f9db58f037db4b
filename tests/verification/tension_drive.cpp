// Tensions in tissue that single cells drive behind arrival times: against the law and the cell model
// integrated here by the classical Runge-Kutta method, or by SingleCells.
#include <cmath>
#include <cstdio>

#include "solver/single_cells.hpp"
#include "tests/driven_slab.hpp"
#include "tests/runge_kutta.hpp"

namespace cohort::test {
namespace {

constexpr double stimulus_mV_per_ms = 35.714, threshold_mV = 0;

/// A number over time since activation, every `interval` ms from `first` on.
struct Course {
  double first, interval;
  std::vector<double> values;
  double at(double t) const {
    const double x = std::clamp((t - first) / interval, 0.0, static_cast<double>(values.size() - 1));
    const auto k = std::min(static_cast<std::size_t>(x), values.size() - 2);
    return values[k] + (x - static_cast<double>(k)) * (values[k + 1] - values[k]);
  }
};

/// Mitchell & Schaeffer 2003, at the model's default numbers: the potential, lifted from rest by a stimulus
/// that ends at the threshold.
Course mitchell_schaeffer(double length_ms) {
  constexpr double h = 0.005, rest = -85, amplitude = 105;
  std::array<double, 2> y = {0, 1};
  double stimulus = stimulus_mV_per_ms / amplitude, crossing = -1;
  Course course{0, h, {rest}};
  for (double t = 0; crossing < 0 || t < crossing + length_ms; t += h) {
    const double before = y[0];
    advance(y, t, h, [&](double, const std::array<double, 2>& z) {
      return std::array<double, 2>{z[1] * z[0] * z[0] * (1 - z[0]) / 0.3 - z[0] / 6 + stimulus,
                                   z[0] < 0.13 ? (1 - z[1]) / 120 : -z[1] / 150};
    });
    const double level = (threshold_mV - rest) / amplitude;
    if (crossing < 0 && y[0] >= level) {
      crossing = t + h * (level - before) / (y[0] - before);
      stimulus = 0;
    }
    course.values.push_back(rest + amplitude * y[0]);
  }
  course.first = -crossing;
  return course;
}

/// The time since activation, in this beat or the last one; before the first, from 6 ms before it on.
double since(double t, double activation, double beat) {
  double result = std::fmod(t, beat) - activation;
  if (result < -6 && t >= beat) result += beat;
  if (result > beat - 6) result -= beat;
  return result;
}

TEST(TensionDrive, NashPanfilovFollowsThePotentialBehindItsArrival) {
  constexpr double beat = 500, dt = 0.2;
  constexpr int steps = 5000;  // two beats
  const Course V = mitchell_schaeffer(beat);
  for (const Precision precision : {Precision::double_, Precision::single_}) {
    DrivenSlab slab("nash_panfilov", "mitchell_schaeffer", {{"time.end_ms", beat}}, {{}}, precision);
    const SolidMesh& mesh = slab.solid->mesh();
    std::vector<float> activation(static_cast<std::size_t>(mesh.cells), -1);
    std::vector<std::size_t> cells;
    for (std::size_t i = 0; i < activation.size(); ++i)
      if (mesh.grid_cell[i] >= 0) cells.push_back(i);
    ASSERT_EQ(cells.size(), 16u);
    const std::vector<double> arrivals = {20, 137.3, 460};  // the last tension goes on over the beat's end
    for (std::size_t k = 0; k < arrivals.size(); ++k) activation[cells[k]] = static_cast<float>(arrivals[k]);
    const auto found = slab.tensions(activation, beat, dt, steps);
    for (std::size_t k = 0; k < arrivals.size(); ++k) {
      std::array<double, 1> T = {0};
      double worst = 0, peak = 0;
      for (int n = 0; n < steps; ++n) {
        advance(T, n * dt, dt, [&](double t, const std::array<double, 1>& z) {
          const double v = (V.at(since(t, arrivals[k], beat)) + 80) / 100;
          const double rate = 0.01 + 0.09 * std::exp(-std::exp(-100 * (v - 0.05)));
          return std::array<double, 1>{rate * (47.9 * std::max(v, 0.0) - z[0])};
        });
        peak = std::max(peak, T[0]);
        worst = std::max(worst, std::abs(found[static_cast<std::size_t>(n)][cells[k]] - T[0]));
      }
      std::printf("nash_panfilov, arrival %.1f ms: peak %.3f kPa, largest difference %.4f kPa\n", arrivals[k],
                  peak, worst);
      EXPECT_GT(peak, 40);
      EXPECT_LT(worst, 0.01 * peak);
    }
    // Without an arrival nothing pulls.
    for (std::size_t k = arrivals.size(); k < cells.size(); ++k)
      for (const std::vector<double>& T : found) ASSERT_LT(std::abs(T[cells[k]]), 1e-5);
  }
}

TEST(TensionDrive, LandFollowsTheCalciumBehindItsArrival) {
  constexpr double beat = 600, dt = 0.1, arrival = 50, h = 0.01;
  constexpr int steps = 6000;
  // The single cell, lifted as the templates' are: first to find the crossing, then with a stimulus that ends
  // there.
  Launcher launcher(device(), Precision::double_);
  SingleCells cell(launcher, Precision::double_, "ten_tusscher_panfilov", 1);
  cell.initialise();
  const auto rise = cell.pace({{1e4, 1, 0}}, {10, stimulus_mV_per_ms}, 10, h, h).V[0];
  std::size_t crossing = 0;
  while (rise[crossing] < threshold_mV) ++crossing;
  cell.initialise();
  const auto trace = cell.pace({{1e4, 1, 0}}, {static_cast<double>(crossing) * h, stimulus_mV_per_ms}, beat,
                               h, 0.05, {"Cai"});
  const Course calcium{-static_cast<double>(crossing) * h, 0.05, trace.states[0][0]};
  ASSERT_GT(*std::max_element(calcium.values.begin(), calcium.values.end()), 4e-4);  // mM

  DrivenSlab slab("calcium", "ten_tusscher_panfilov", {{"time.end_ms", beat}});
  const SolidMesh& mesh = slab.solid->mesh();
  std::vector<float> activation(static_cast<std::size_t>(mesh.cells), -1);
  std::size_t i = 0;
  while (mesh.grid_cell[i] < 0) ++i;
  activation[i] = arrival;
  const auto found = slab.tensions(activation, beat, dt, steps);

  // Land et al. 2017 at a stretch of 1, where nothing distorts: troponin, blocked, weakly and strongly bound.
  constexpr double r_s = 0.25, r_w = 0.5, k_uw = 0.182, k_ws = 0.012, free = 1 - r_s - (1 - r_s) * r_w;
  const double k_b = std::pow(0.35, 5) / free, k_wu = k_uw * (1 / r_w - 1) - k_ws,
               k_su = k_ws * r_w * (1 / r_s - 1);
  std::array<double, 4> y = {0, 1, 0, 0};  // as the law's states at rest: nothing bound
  double worst = 0, peak = 0;
  for (int n = 0; n < steps; ++n) {
    for (int part = 0; part < 10; ++part)
      advance(y, n * dt + part * dt / 10, dt / 10, [&](double t, const std::array<double, 4>& z) {
        const double Ca = 1000 * calcium.at(since(t, arrival, beat));
        const double R = std::max(z[0], 1e-6), U = 1 - z[1] - z[2] - z[3];
        return std::array<double, 4>{0.1 * (std::pow(Ca / 0.805, 2) * (1 - z[0]) - z[0]),
                                     k_b * std::min(std::pow(R, -2.5), 100.0) * U - std::pow(R, 2.5) * z[1],
                                     k_uw * U - (k_wu + k_ws) * z[2], k_ws * z[2] - k_su * z[3]};
      });
    const double T = 120 / r_s * y[3];
    peak = std::max(peak, T);
    worst = std::max(worst, std::abs(found[static_cast<std::size_t>(n)][i] - T));
  }
  std::printf("calcium: peak %.3f kPa, largest difference %.4f kPa\n", peak, worst);
  EXPECT_GT(peak, 5);
  EXPECT_LT(worst, 0.01 * peak);
}

// Each region's and each member's cells have their own potential; who else is in the batch does not matter.
TEST(TensionDrive, DependsOnTheMemberAlone) {
  const std::string tau = "electrophysiology.mitchell_schaeffer.tau_close_ms";
  const Settings set = {{"time.end_ms", 400}};
  const auto last = [&](const std::vector<Settings>& members) {
    DrivenSlab slab("nash_panfilov", "mitchell_schaeffer", set, members, Precision::single_);
    const std::vector<float> activation(static_cast<std::size_t>(slab.solid->mesh().cells), 5);
    const std::vector<double> T = slab.tensions(activation, 1e9, 0.5, 680).back();
    std::vector<double> first_cells;
    for (std::size_t m = 0; m < members.size(); ++m)
      for (std::size_t i = static_cast<std::size_t>(slab.solid->mesh().cell_blocks[m] * SolidMesh::block);;
           ++i)
        if (slab.solid->mesh().grid_cell[i] >= 0) {
          first_cells.push_back(T[i]);
          break;
        }
    return first_cells;
  };
  const Settings brief = {{tau, 60}}, usual = {}, lengthy = {{tau, 200}};
  const std::vector<double> together = last({lengthy, brief, usual, brief});
  EXPECT_EQ(together[0], last({lengthy})[0]);
  EXPECT_EQ(together[1], last({brief})[0]);
  EXPECT_EQ(together[2], last({usual, brief})[0]);
  EXPECT_EQ(together[1], together[3]);
  EXPECT_GT(together[0], 1.2 * together[2]);
  EXPECT_GT(together[2], 1.2 * together[1]);
}

TEST(TensionDrive, TellsCellsThatNoStimulusLifts) {
  const std::string tau = "electrophysiology.mitchell_schaeffer.tau_in_ms",
                    threshold = "electrophysiology.activation_threshold_mV";
  DrivenSlab slab("nash_panfilov", "mitchell_schaeffer", {{"time.end_ms", 100}, {threshold, 0}},
                  {{}, {{"electrophysiology.mitchell_schaeffer.amplitude_mV", 10}, {tau, 5}}});
  EXPECT_EQ(slab.drive->defect(0), "");
  EXPECT_NE(slab.drive->defect(1).find("do not rise through electrophysiology.activation_threshold_mV"),
            std::string::npos)
      << slab.drive->defect(1);
}

}  // namespace
}  // namespace cohort::test
