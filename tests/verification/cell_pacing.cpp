// Action potentials and restitution of every cell model against its equations integrated by another program
// (tests/reference/cells.csv, make_cells.py), and against what the papers say of them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>

#include "solver/single_cells.hpp"
#include "solver/time_steps.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Set = std::map<std::string, double>;

/// Parameters of the layers, as the heads of the model files list them.
Set layer_parameters(const std::string& model, const std::string& layer) {
  if (model == "ten_tusscher_panfilov" && layer == "endo") return {{"gto", 0.073}, {"endocardial", 1}};
  if (model == "ten_tusscher_panfilov" && layer == "mid") return {{"gKs", 0.098}};
  if (model == "bueno_orovio" && layer == "endo")
    return {{"u_u", 1.56},           {"theta_v_minus", 0.2},
            {"tau_v1_minus_ms", 75}, {"tau_v2_minus_ms", 10},
            {"tau_w1_minus_ms", 6},  {"tau_w2_minus_ms", 140},
            {"k_w_minus", 200},      {"u_w_minus", 0.016},
            {"tau_w_plus_ms", 280},  {"tau_fi_ms", 0.1},
            {"tau_o1_ms", 470},      {"tau_so1_ms", 40},
            {"tau_so2_ms", 1.2},     {"k_so", 2},
            {"tau_s2_ms", 2},        {"tau_si_ms", 2.9013},
            {"tau_w_inf", 0.0273},   {"w_inf_star", 0.78}};
  if (model == "bueno_orovio" && layer == "mid")
    return {{"u_u", 1.61},
            {"theta_v_minus", 0.1},
            {"theta_o", 0.005},
            {"tau_v1_minus_ms", 80},
            {"tau_v2_minus_ms", 1.4506},
            {"tau_w1_minus_ms", 70},
            {"tau_w2_minus_ms", 8},
            {"k_w_minus", 200},
            {"u_w_minus", 0.016},
            {"tau_w_plus_ms", 280},
            {"tau_fi_ms", 0.078},
            {"tau_o1_ms", 410},
            {"tau_o2_ms", 7},
            {"tau_so1_ms", 91},
            {"tau_so2_ms", 0.8},
            {"k_so", 2.1},
            {"u_so", 0.6},
            {"tau_s2_ms", 4},
            {"tau_si_ms", 3.3849},
            {"tau_w_inf", 0.01},
            {"w_inf_star", 0.5}};
  return {};
}

SingleCells::Stimulus stimulus_of(const std::string& model) {
  if (model == "fitzhugh_nagumo") return {2, 40};
  if (model == "bueno_orovio") return {1, 40};
  if (model == "ten_tusscher_panfilov") return {1, 38};
  return {2, 20};
}

double automatic_step(SingleCells& cells) {
  Scene scene;
  scene.cell_model = cells.model().name;
  declare_parameters(scene);
  return choose_steps(scene, cells.fastest_rate(), 1e9).dt_ms;
}

/// One beat of a trace: what tests/reference/make_cells.py lists.
struct Beat {
  double rest, peak, duration, slope, Cai_rest, Cai_peak;
};

struct Row {
  std::string layer;
  int interval;
  Beat beat;
};

std::vector<Row> reference(const std::string& model) {
  std::ifstream file(COHORT_SOURCE_DIR "/tests/reference/cells.csv");
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#")) continue;
    std::istringstream fields(line);
    std::vector<std::string> field;
    for (std::string text; std::getline(fields, text, ',');) field.push_back(text);
    if (field[0] != model) continue;
    const auto number = [&](std::size_t k) { return std::stod(field[k]); };
    rows.push_back(
        {field[1], std::stoi(field[2]), {number(3), number(4), number(5), number(6), number(7), number(8)}});
  }
  if (rows.empty()) throw std::runtime_error("no " + model + " in cells.csv");
  return rows;
}

/// Time from the upward to the downward crossing of `level` in [first, last), ms; -1 where there is none.
double duration(const std::vector<double>& V, std::size_t first, std::size_t last, double level,
                double interval) {
  const auto cross = [&](std::size_t i) {
    return (static_cast<double>(i - 1) + (level - V[i - 1]) / (V[i] - V[i - 1])) * interval;
  };
  std::size_t up = first;
  while (up < last && V[up] <= level) ++up;
  std::size_t down = up;
  while (down < last && V[down] >= level) ++down;
  if (down >= last) return -1;
  return cross(down) - (up > first ? cross(up) : static_cast<double>(first) * interval);
}

Beat measure(const SingleCells::Trace& trace, std::size_t cell, double start, double length, double rest,
             double level) {
  const auto index = [&](double time) {
    return std::min(static_cast<std::size_t>(std::lround(time / trace.interval_ms)),
                    trace.V[cell].size() - 1);
  };
  const std::vector<double>& V = trace.V[cell];
  const std::size_t first = index(start), last = index(start + length);
  Beat beat{rest, -1000, 0, 0, 0, 0};
  for (std::size_t i = first; i < last; ++i) {
    beat.peak = std::max(beat.peak, V[i]);
    beat.slope = std::max(beat.slope, (V[i + 1] - V[i]) / trace.interval_ms);
  }
  if (level < -999) level = rest + 0.1 * (beat.peak - rest);
  beat.duration = duration(V, first, last, level, trace.interval_ms);
  if (!trace.states[cell].empty()) {
    const std::vector<double>& Cai = trace.states[cell][0];
    beat.Cai_rest = 1e3 * Cai[first];
    for (std::size_t i = first; i < last; ++i) beat.Cai_peak = std::max(beat.Cai_peak, 1e3 * Cai[i]);
  }
  return beat;
}

bool has_calcium(const CellModel& model) {
  return std::any_of(model.states.begin(), model.states.end(), [](const auto& s) { return s.name == "Cai"; });
}

constexpr double from_the_beat = -1000;  // the level follows from the beat itself

/// The rows of the reference, measured by ours: a train of five, one pulse more where the row says so.
std::vector<Beat> ours(const std::string& model, const std::vector<Row>& rows, Precision precision, double dt,
                       double sample) {
  Launcher launcher(device(), precision);
  SingleCells cells(launcher, precision, model, static_cast<int>(rows.size()));
  std::vector<SingleCells::Pacing> pacing;
  double longest = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    for (const auto& [name, value] : layer_parameters(model, rows[k].layer))
      cells.set(static_cast<int>(k), name, value);
    pacing.push_back({1000, 5, static_cast<double>(rows[k].interval)});
    longest = std::max(longest, static_cast<double>(rows[k].interval));
  }
  cells.initialise();
  if (dt <= 0) dt = automatic_step(cells);
  const SingleCells::Stimulus stimulus = stimulus_of(model);
  const std::vector<std::string> record =
      has_calcium(cells.model()) ? std::vector<std::string>{"Cai"} : std::vector<std::string>{};
  cells.pace(pacing, stimulus, 4000, dt, 4000);
  // The train's last pulse starts this stretch; the counts go on from it.
  for (SingleCells::Pacing& p : pacing) p.pulses = 1;
  const SingleCells::Trace trace = cells.pace(pacing, stimulus, longest + 1000, dt, sample, record);
  std::vector<Beat> beats;
  double level = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto interval = static_cast<double>(rows[k].interval);
    const double rest = trace.V[k][0];
    if (rows[k].interval == 0) {
      beats.push_back(measure(trace, k, 0, 1000, rest, from_the_beat));
      level = rest + 0.1 * (beats.back().peak - rest);
    } else {
      const auto before = static_cast<std::size_t>(std::lround(interval / trace.interval_ms));
      beats.push_back(measure(trace, k, interval, 1000, trace.V[k][before], level));
    }
  }
  return beats;
}

class CellModels : public testing::TestWithParam<std::string> {};

// In single precision at the automatic step. Tolerances: those of the published trace
// (tests/reference/ten_tusscher_2006.yaml) for potentials and calcium; for durations 1 ms or half a per cent,
// a quarter of what the eleven codes of Niederer et al. differ by in activation at their finest grid.
TEST_P(CellModels, FollowTheEquationsIntegratedByAnotherProgram) {
  const std::vector<Row> rows = reference(GetParam());
  const std::vector<Beat> coarse = ours(GetParam(), rows, Precision::single_, 0, 0.1);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Beat &want = rows[k].beat, &is = coarse[k];
    std::printf(
        "%s %-4s after %4d ms: rest %8.3f (%+.3f)  peak %7.3f (%+.3f)  APD90 %7.2f (%+.3f)  Cai %.4f to %.4f "
        "(%+.2f %%)\n",
        GetParam().c_str(), rows[k].layer.c_str(), rows[k].interval, is.rest, is.rest - want.rest, is.peak,
        is.peak - want.peak, is.duration, is.duration - want.duration, is.Cai_rest, is.Cai_peak,
        want.Cai_peak > 0 ? 100 * (is.Cai_peak / want.Cai_peak - 1) : 0);
    EXPECT_NEAR(is.rest, want.rest, 0.5) << k;
    EXPECT_NEAR(is.peak, want.peak, 2) << k;
    EXPECT_NEAR(is.duration, want.duration, std::max(1.0, 0.005 * want.duration)) << k;
    if (want.Cai_peak > 0) {
      EXPECT_NEAR(is.Cai_rest, want.Cai_rest, 0.02 * want.Cai_rest) << k;
      EXPECT_NEAR(is.Cai_peak, want.Cai_peak, 0.02 * want.Cai_peak) << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, CellModels,
                         testing::Values("fitzhugh_nagumo", "aliev_panfilov", "bueno_orovio",
                                         "ten_tusscher_panfilov", "courtemanche"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace cohort::test
