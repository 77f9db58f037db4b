#include "ensemble/work_precision.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "ensemble/choose_device.hpp"
#include "ensemble/draw.hpp"
#include "ensemble/guarded.hpp"
#include "ensemble/interrupt.hpp"
#include "ensemble/measure_accuracy.hpp"
#include "ensemble/work_precision_store.hpp"

namespace cohort {

namespace {

/// Leaves out the settings that an interrupted study has not run.
void keep_what_has_run(WorkPrecision& result) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    if (result.runs[i].device_s.empty()) continue;
    if (kept != i) {
      result.runs[kept] = std::move(result.runs[i]);
      result.design.settings[kept] = std::move(result.design.settings[i]);
    }
    ++kept;
  }
  result.runs.resize(kept);
  result.design.settings.resize(kept);
}

WorkPrecision study_scene(Device& device, const Study& study, const WorkPrecisionDesign& design,
                          const Setting& scene) {
  WorkPrecision result;
  result.scene = scene.label;
  result.design = design;
  result.device = device.info().name;
  result.triad_GB_per_s = device.triad_GB_per_s();
  result.whole = run_settings(device, in_scene(study, scene), design, result.reference, result.runs);
  if (!result.whole) keep_what_has_run(result);
  result.has_rows = result.runs.size() == design.settings.size();
  if (result.runs.empty()) throw std::runtime_error("interrupted before a setting had run");
  result.errors = measure_errors(design.measures, result.runs, design.reference ? &result.reference : nullptr,
                                 design.known);
  result.orders = observed_orders(result.runs, design.reference ? &result.reference : nullptr, result.errors);
  result.rounding = rounding_shares(result.runs, result.errors);
  return result;
}

}  // namespace

ExitCode run_work_precision(Study& study, const CampaignOptions& options) {
  const WorkPrecisionDesign design = read_work_precision(study);
  const std::filesystem::path store = study.store;
  if (!store.parent_path().empty() && !std::filesystem::exists(store.parent_path()))
    throw std::runtime_error(
        fmt::format("{}: folder {} does not exist", study.store, store.parent_path().string()));
  share_cores({});
  Device device(choose_device(options.device, {}));
  catch_interrupts();
  return guarded(ExitCode::interrupted, [&] {
    std::vector<WorkPrecision> scenes;
    for (const Setting& scene : design.scenes) {
      scenes.push_back(study_scene(device, study, design, scene));
      if (!scenes.back().whole) break;
    }
    const bool whole = scenes.back().whole;
    if (!whole) spdlog::warn("interrupted: what has run until now is written");
    write_study(study.store, study, scenes);
    const std::string csv = std::filesystem::path(store).replace_extension(".csv").string();
    write_file(csv, study_csv(scenes));
    if (!design.measurements.empty() && scenes.front().has_rows)
      write_file(design.measurements, measurements_text(measurements_of(study, scenes.front())));
    for (const WorkPrecision& scene : scenes) fmt::print("{}", study_report(scene));
    std::fflush(stdout);
    const std::string picture = std::filesystem::path(store).replace_extension(".png").string();
    const bool drawn = draw("study", {study.store, "-o", picture});
    spdlog::info("{}, {}{}", study.store, csv, drawn ? ", " + picture : "");
    return whole ? ExitCode::done : ExitCode::interrupted;
  });
}

}  // namespace cohort
