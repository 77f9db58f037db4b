// Every cell model stays finite and within its bounds: kicked to any potential, with every parameter at
// either end of its range, with steps twice as long as it asks for, in single precision.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "solver/single_cells.hpp"
#include "solver/time_steps.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

constexpr double duration = 400;  // ms: a paced beat and the return to rest

bool is_concentration(const std::string& state) {
  return state.starts_with("Ca");
}
bool is_gate(const std::string& model, const std::string& state) {
  const bool recovery = model == "fitzhugh_nagumo" || model == "aliev_panfilov";  // grows beyond 1
  return !recovery && !is_concentration(state) && !state.ends_with("_change");
}

/// Runs the cells, with `labels` for messages, and looks at them every 5 ms. Largest allowed |V| in mV.
void run(SingleCells& cells, const std::vector<std::string>& labels, double dt, double largest) {
  const CellModel& model = cells.model();
  std::vector<std::string> names;
  for (const auto& state : model.states) names.push_back(state.name);
  const std::vector<SingleCells::Pacing> pacing(static_cast<std::size_t>(cells.cells()), {200, 2, 0});
  const SingleCells::Trace trace = cells.pace(pacing, {1, 40}, duration, dt, 5, names);
  for (std::size_t c = 0; c < labels.size(); ++c) {
    const std::string where = model.name + ", " + labels[c];
    for (std::size_t t = 0; t < trace.V[c].size(); ++t) {
      ASSERT_TRUE(std::isfinite(trace.V[c][t])) << where << " at " << 5 * t;
      ASSERT_LE(std::abs(trace.V[c][t]), largest) << where << " at " << 5 * t;
      for (std::size_t k = 0; k < names.size(); ++k) {
        const double x = trace.states[c][k][t];
        ASSERT_TRUE(std::isfinite(x)) << where << ", " << names[k] << " at " << 5 * t;
        if (is_gate(model.name, names[k])) {
          ASSERT_GE(x, 0) << where << ", " << names[k] << " at " << 5 * t;
          ASSERT_LE(x, 1 + 1e-6) << where << ", " << names[k] << " at " << 5 * t;
        }
        if (is_concentration(names[k])) {
          ASSERT_GT(x, 0) << where << ", " << names[k] << " at " << 5 * t;
          ASSERT_LT(x, 100) << where << ", " << names[k] << " at " << 5 * t;
        }
      }
    }
  }
}

class CellModels : public testing::TestWithParam<std::string> {
 protected:
  double twice_the_automatic_step() {
    Launcher launcher(device(), Precision::single_);
    SingleCells one(launcher, Precision::single_, GetParam(), 1);
    Scene scene;
    scene.cell_model = GetParam();
    declare_parameters(scene);
    return 2 * choose_steps(scene, one.fastest_rate(), 1e9).dt_ms;
  }
};

TEST_P(CellModels, SurviveKicksToAnyPotential) {
  Launcher launcher(device(), Precision::single_);
  std::vector<double> V = {-200, 15, 0, -47.13, -40, -14.1, -10, 7.9, 19.9, 3.3328, 200};
  for (double v = -150; v <= 100; v += 10) V.push_back(v);
  SingleCells cells(launcher, Precision::single_, GetParam(), static_cast<int>(V.size()));
  cells.initialise();
  std::vector<double> states = cells.states();
  cells.write(V, states);
  std::vector<std::string> labels;
  for (const double v : V) labels.push_back("from " + std::to_string(v) + " mV");
  run(cells, labels, twice_the_automatic_step(), 250);
}

TEST_P(CellModels, SurviveEveryParameterAtEitherEnd) {
  Launcher launcher(device(), Precision::single_);
  const CellModel model = read_cell_model(GetParam());
  SingleCells cells(launcher, Precision::single_, GetParam(), static_cast<int>(2 * model.parameters.size()));
  std::vector<std::string> labels;
  for (const Parameter& p : model.parameters)
    for (const double value : {p.lower, p.upper}) {
      cells.set(static_cast<int>(labels.size()), p.path, value);
      labels.push_back(p.path + " = " + std::to_string(value));
    }
  cells.initialise();
  // The step of the fastest of them: a member takes its own.
  Scene scene;
  scene.cell_model = GetParam();
  declare_parameters(scene);
  const double dt = choose_steps(scene, cells.fastest_rate(), 1e9).dt_ms;
  std::printf("%s: %zu cells with dt %.4f ms\n", GetParam().c_str(), labels.size(), dt);
  run(cells, labels, 2 * dt, 1000);
}

INSTANTIATE_TEST_SUITE_P(All, CellModels,
                         testing::Values("fitzhugh_nagumo", "aliev_panfilov", "bueno_orovio",
                                         "ten_tusscher_panfilov", "courtemanche"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace cohort::test
