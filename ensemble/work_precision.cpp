#include "ensemble/work_precision.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <utility>

#include "ensemble/choose_device.hpp"
#include "ensemble/config.hpp"
#include "ensemble/draw.hpp"
#include "ensemble/guarded.hpp"
#include "ensemble/interrupt.hpp"
#include "ensemble/measure_accuracy.hpp"
#include "ensemble/ranks.hpp"
#include "ensemble/study_files.hpp"
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

/// Where a setting is as fine as the reference or finer, errors are no errors of the setting.
void warn_of_coarse_reference(const Study& study, const WorkPrecisionDesign& design) {
  if (!design.reference) return;
  const ResolvedSetting reference = resolved(campaign_of(study, design.reference->overrides(), study.file));
  for (const Setting& setting : design.settings) {
    const ResolvedSetting own = resolved(campaign_of(study, setting.overrides(), study.file));
    bool differs = false, is_finer = false;
    std::string coarser;
    for (const auto& [path, h] : own.values) {
      const auto there = reference.values.find(path);
      if (!is_step(path) || there == reference.values.end() || h == there->second || h <= 0) continue;
      differs = true;
      is_finer = is_finer || there->second < h;
      if (there->second > h) coarser = path;
    }
    if (!coarser.empty() && !is_finer)
      spdlog::warn("the reference is coarser than \"{}\" in {}: what they differ by is the reference's error",
                   setting.label, coarser);
    else if (!differs && own.rest == reference.rest && own.precision == reference.precision)
      spdlog::warn("the reference has the spacings and steps of \"{}\": its error is not known",
                   setting.label);
  }
}

WorkPrecision study_scene(Device& device, const Study& study, const WorkPrecisionDesign& design,
                          const Setting& scene) {
  WorkPrecision result;
  result.scene = scene.label;
  result.design = design;
  result.device = device.info().name;
  result.triad_GB_per_s = device.triad_GB_per_s();
  const Study own = in_scene(study, scene);
  warn_of_coarse_reference(own, design);
  result.whole = run_settings(device, own, design, result.reference, result.runs);
  if (!result.whole) keep_what_has_run(result);
  result.has_rows = result.runs.size() == design.settings.size();
  if (result.runs.empty()) throw std::runtime_error("interrupted before a setting had run");
  result.errors = measure_errors(design.measures, result.runs, design.reference ? &result.reference : nullptr,
                                 design.known);
  result.orders = observed_orders(result.runs, design.reference ? &result.reference : nullptr, result.errors);
  result.rounding = rounding_shares(result.runs, result.errors);
  return result;
}

/// Tells that an interrupt has come, and ends the program on the second one: a run may take hours.
void watch_interrupts(const std::stop_token& stop) {
  using namespace std::chrono_literals;
  for (bool told = false; !stop.stop_requested(); std::this_thread::sleep_for(50ms)) {
    if (interrupts() > 1) {
      spdlog::error("interrupted again: nothing is written");
      std::_Exit(static_cast<int>(ExitCode::interrupted));
    }
    if (interrupts() > 0 && !std::exchange(told, true))
      spdlog::warn("interrupted: ends behind the run at hand; once more ends it at once");
  }
}

}  // namespace

ExitCode run_work_precision(Study& study, const CampaignOptions& options) {
  const WorkPrecisionDesign design = read_work_precision(study);
  check_work_precision_files(study, design.measurements);
  const Ranks ranks;
  if (ranks.size() > 1)
    throw ConfigError({fmt::format("{}: a study of error against run time runs on one rank, and there are {}",
                                   study.file, ranks.size())});
  const std::filesystem::path store = study.store;
  share_cores({});
  Device device(choose_device(options.device, {}));
  catch_interrupts();
  const std::jthread watch(watch_interrupts);
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
      write_file(design.measurements,
                 measurements_text(measurements_of(in_scene(study, design.scenes.front()), scenes.front())));
    for (const WorkPrecision& scene : scenes) fmt::print("{}", study_report(scene));
    std::fflush(stdout);
    const std::string picture = std::filesystem::path(store).replace_extension(".png").string();
    const bool drawn = draw("study", {study.store, "-o", picture});
    const bool measured = !design.measurements.empty() && scenes.front().has_rows;
    spdlog::info("{}, {}{}{}", study.store, csv, drawn ? ", " + picture : "",
                 measured ? ", " + design.measurements : "");
    return whole ? ExitCode::done : ExitCode::interrupted;
  });
}

}  // namespace cohort
