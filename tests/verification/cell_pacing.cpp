// Action potentials and restitution of every cell model against its equations integrated by another program
// (tests/reference/cells.csv, make_cells.py), and against what the papers say of them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "tests/cells.hpp"

namespace cohort::test {
namespace {

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
    std::printf("| %s | %s | %d | %.2f (%+.2f) | %.2f (%+.2f) | %.1f (%+.2f) | ", GetParam().c_str(),
                rows[k].layer.c_str(), rows[k].interval, want.rest, is.rest - want.rest, want.peak,
                is.peak - want.peak, want.duration, is.duration - want.duration);
    if (want.Cai_peak > 0)
      std::printf("%.3f (%+.1f %%) | %.3f (%+.1f %%) |\n", want.Cai_rest,
                  100 * (is.Cai_rest / want.Cai_rest - 1), want.Cai_peak,
                  100 * (is.Cai_peak / want.Cai_peak - 1));
    else
      std::printf("- | - |\n");
    EXPECT_NEAR(is.rest, want.rest, 0.5) << k;
    EXPECT_NEAR(is.peak, want.peak, 2) << k;
    EXPECT_NEAR(is.duration, want.duration, std::max(1.0, 0.005 * want.duration)) << k;
    if (want.Cai_peak > 0) {
      EXPECT_NEAR(is.Cai_rest, want.Cai_rest, 0.02 * want.Cai_rest) << k;
      EXPECT_NEAR(is.Cai_peak, want.Cai_peak, 0.02 * want.Cai_peak) << k;
    }
  }
}

// Twenty beats in single and in double precision, with two fifths of the model's own step (0.02 ms where that
// is 0.05), since increments are small then: 0.1 ms of duration and 0.2 % of calcium, both below what the
// step itself costs.
TEST_P(CellModels, NeedNoDoublePrecision) {
  const auto last_beat = [&](Precision precision) {
    Launcher launcher(device(), precision);
    SingleCells cell(launcher, precision, GetParam(), 1);
    cell.initialise();
    const std::vector<std::string> record =
        has_calcium(cell.model()) ? std::vector<std::string>{"Cai"} : std::vector<std::string>{};
    const double dt = 0.4 * automatic_step(cell);
    cell.pace({{1000, 20, 0}}, stimulus_of(GetParam()), 20000, dt, 20000);
    const double rest = cell.potential()[0];
    return measure(cell.pace({{1000, 1, 0}}, stimulus_of(GetParam()), 900, dt, 0.1, record), 0, 0, 900, rest,
                   from_the_beat);
  };
  const Beat single = last_beat(Precision::single_), exact = last_beat(Precision::double_);
  std::printf("%s, 20 beats: APD90 %.3f ms, in double precision %.3f ms\n", GetParam().c_str(),
              single.duration, exact.duration);
  EXPECT_NEAR(single.duration, exact.duration, 0.1);
  EXPECT_NEAR(single.Cai_peak, exact.Cai_peak, 0.002 * exact.Cai_peak);
}

INSTANTIATE_TEST_SUITE_P(All, CellModels,
                         testing::Values("fitzhugh_nagumo", "aliev_panfilov", "bueno_orovio",
                                         "ten_tusscher_panfilov", "courtemanche"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace cohort::test
