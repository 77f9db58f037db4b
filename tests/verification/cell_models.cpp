// Single cells through the solver's own step: the published trace of ten Tusscher & Panfilov 2006,
// tests/reference/ten_tusscher_2006.yaml.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "solver/time_steps.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Settings = std::vector<std::pair<std::string, double>>;

/// A row of eight cells without diffusion between them, under one pulse.
std::unique_ptr<Slab> uncoupled_cells(const std::string& model, Precision precision,
                                      const Settings& parameters, double start, double duration,
                                      double amplitude) {
  Settings set = {{"electrophysiology.conductivity_longitudinal_mS_per_mm", 0},
                  {"electrophysiology.conductivity_transverse_mS_per_mm", 0},
                  {"stimuli.pulse.start_ms", start},
                  {"stimuli.pulse.duration_ms", duration},
                  {"stimuli.pulse.amplitude_mV_per_ms", amplitude},
                  {"stimuli.pulse.radius_mm", 100}};
  for (const auto& [name, value] : parameters)
    set.emplace_back("electrophysiology." + model + "." + name, value);
  return std::make_unique<Slab>(std::array<double, 3>{8, 1, 1}, 1, precision, model, set,
                                std::vector<Stimulus>{{"pulse", Stimulus::Kind::sphere, ""}});
}

double automatic_step(const Slab& cells) {
  return choose_steps(cells.scene, cells.monodomain->fastest_rate()[0], 1e9).dt_ms;
}

struct Trace {
  std::vector<double> V, Cai;  ///< mV and uM at the times asked for
  double peak = -1000;         ///< mV
};

/// times in ms, multiples of dt.
Trace trace(Slab& cells, const std::vector<double>& times, double dt) {
  const CellModel model = read_cell_model(cells.scene.cell_model);
  const auto Cai =
      std::find_if(model.states.begin(), model.states.end(), [](const auto& s) { return s.name == "Cai"; });
  const auto index = static_cast<size_t>(Cai - model.states.begin());
  const auto stride = static_cast<size_t>(cells.tissue->stride);
  std::size_t cell = 0;
  cells.each_cell([&](std::size_t i, const auto&) { cell = i; });
  cells.monodomain->initialise(*cells.tissue, cells.parameters, dt, 1);
  Trace result;
  int step = 0;
  for (const double time : times) {
    for (; step < std::lround(time / dt); ++step) {
      cells.monodomain->advance(*cells.tissue, cells.parameters, step * dt, step == 0);
      if (step * dt < 10)
        result.peak = std::max(result.peak, cells.read(cells.monodomain->potential(), 1, cell)[0]);
    }
    result.V.push_back(cells.read(cells.monodomain->potential(), 1, cell)[0]);
    result.Cai.push_back(1e3 * cells.read(cells.monodomain->states(), 1, index * stride + cell)[0]);
  }
  return result;
}

TEST(TenTusscherPanfilov, FollowsThePublishedTrace) {
  const YAML::Node reference = YAML::LoadFile(COHORT_SOURCE_DIR "/tests/reference/ten_tusscher_2006.yaml");
  const auto times = reference["t_ms"].as<std::vector<double>>(),
             V = reference["V_mV"].as<std::vector<double>>(),
             Cai = reference["Cai_uM"].as<std::vector<double>>();
  const auto V_tolerance = reference["tolerance"]["V_mV"].as<double>(),
             peak_tolerance = reference["tolerance"]["peak_V_mV"].as<double>(),
             Cai_tolerance = reference["tolerance"]["Cai_relative"].as<double>();
  const double published_peak = *std::max_element(V.begin(), V.end());
  for (const Precision precision : {Precision::single_, Precision::double_}) {
    const auto cells = uncoupled_cells("ten_tusscher_panfilov", precision, {}, 5, 1, 38);
    const double automatic = automatic_step(*cells);
    for (const double dt : {automatic, 0.02, 0.005}) {
      const Trace found = trace(*cells, times, dt);
      double worst_V = 0, worst_Cai = 0, at_peak = 0;
      for (std::size_t k = 0; k < times.size(); ++k) {
        const double error = found.V[k] - V[k];
        if (V[k] == published_peak)
          at_peak = error;
        else
          worst_V = std::max(worst_V, std::abs(error));
        worst_Cai = std::max(worst_Cai, std::abs(found.Cai[k] / Cai[k] - 1));
      }
      std::printf("%s dt %.4f ms%s: V within %.3f mV, at 7 ms %+.3f mV, Cai within %.4f, peak %.2f mV\n",
                  precision == Precision::single_ ? "single" : "double", dt,
                  dt == automatic ? " (automatic)" : "", worst_V, at_peak, worst_Cai, found.peak);
      EXPECT_LE(worst_V, V_tolerance) << dt;
      EXPECT_LE(std::abs(at_peak), peak_tolerance) << dt;
      EXPECT_LE(worst_Cai, Cai_tolerance) << dt;
    }
  }
}

}  // namespace
}  // namespace cohort::test
