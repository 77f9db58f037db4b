// Restitution of a cell in its steady state, 1000 beats at 1 Hz and an extra pulse, against curves that
// another code published (tests/reference/s1s2.csv says which).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "tests/cells.hpp"

namespace cohort::test {
namespace {

struct Point {
  double S2, apd;
};

std::vector<Point> published(const std::string& model) {
  std::ifstream file(COHORT_SOURCE_DIR "/tests/reference/s1s2.csv");
  std::vector<Point> result;
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    std::string name;
    std::getline(fields, name, ',');
    Point point{};
    char comma;
    if (name == model && fields >> point.S2 >> comma >> point.apd) result.push_back(point);
  }
  return result;
}

/// The first maximum of V from sample `at` on that is above -40 mV.
double spike(const std::vector<double>& V, std::size_t at) {
  while (at + 1 < V.size() && (V[at] < -40 || V[at + 1] > V[at])) ++at;
  return V[at];
}

struct Case {
  std::string model;
  SingleCells::Stimulus stimulus;
  CellParameters parameters;
};

class S1S2 : public testing::TestWithParam<Case> {};

// Stimuli are those of the CellML files, and so is what they do to potassium: nothing in Courtemanche's
// model, which 1000 beats show. Tolerance: 1 ms for the model's own step (cell_papers.cpp allows as much) and
// 1 ms for the reference's samples.
TEST_P(S1S2, CurveIsThePublishedOne) {
  const auto& [model, stimulus, parameters] = GetParam();
  constexpr double dt = 0.05, sample = 0.5, tolerance = 2;
  const std::vector<Point> reference = published(model);
  ASSERT_EQ(reference.size(), 16u);
  Launcher launcher(device(), Precision::double_);

  const auto set = [&, &values = parameters](SingleCells& cells) {
    for (int i = 0; i < cells.cells(); ++i)
      for (const auto& [name, value] : values) cells.set(i, name, value);
  };
  SingleCells first(launcher, Precision::double_, model, 1);
  set(first);
  first.initialise();
  first.pace({{1000, 1000, 0}}, stimulus, 1e6, dt, 1e6);
  const std::vector<double> V1 = first.potential(), states1 = first.states();

  const int count = static_cast<int>(reference.size());
  SingleCells cells(launcher, Precision::double_, model, count);
  set(cells);
  std::vector<double> V(reference.size(), V1[0]), states;
  for (const double state : states1) states.insert(states.end(), reference.size(), state);
  cells.write(V, states);
  std::vector<SingleCells::Pacing> pacing;
  for (const Point& point : reference) pacing.push_back({5000, 1, point.S2});
  const SingleCells::Trace trace = cells.pace(pacing, stimulus, 3000, dt, sample);
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const std::vector<double>& beat = trace.V[i];
    const double rest = *std::min_element(beat.begin(), beat.end());
    const auto at = static_cast<std::size_t>(std::lround(reference[i].S2 / sample));
    const auto level = [&](std::size_t from) { return rest + 0.1 * (spike(beat, from) - rest); };
    const double before = duration(beat, 0, at, level(0), sample),
                 apd = duration(beat, at, beat.size(), level(at), sample);
    std::printf("| %s | %.0f | %.0f | %.1f | %.1f (%+.2f) |\n", model.c_str(), reference[i].S2,
                reference[i].S2 - before, reference[i].apd, apd, apd - reference[i].apd);
    EXPECT_NEAR(apd, reference[i].apd, tolerance) << "S2 " << reference[i].S2;
  }
}

INSTANTIATE_TEST_SUITE_P(All, S1S2,
                         testing::Values(Case{"courtemanche", {2, 20}, {{"stimulus_potassium", 0}}},
                                         Case{"ten_tusscher_panfilov", {1, 52}, {}}),
                         [](const auto& test) { return test.param.model; });

}  // namespace
}  // namespace cohort::test
