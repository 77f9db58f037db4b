#include "ensemble/measure_accuracy.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>

#include "ensemble/feature_names.hpp"
#include "ensemble/members.hpp"
#include "solver/mechanics.hpp"

namespace cohort {

namespace {

constexpr double unknown = std::numeric_limits<double>::infinity();

bool is_length_or_step(const std::string& path) {
  return path.ends_with("dx_mm") || path.ends_with("dt_ms") || path.ends_with("step_factor");
}

/// The largest ratio of a step of the reference to that of a setting. What neither sets they share.
double nearness(const Campaign& setting, const Campaign& reference) {
  double most = 0;
  for (const Parameter& parameter : setting.scene.parameters.all()) {
    if (!is_length_or_step(parameter.path)) continue;
    const int place = reference.scene.parameters.find(parameter.path);
    if (place < 0) continue;
    const auto step = [](const Campaign& campaign, const Parameter& own) {
      return own.path == "mechanics.dx_mm" ? solid_dx_mm(campaign.scene) : own.value;
    };
    const double own = step(setting, parameter), finer = step(reference, reference.scene.parameters[place]);
    if (own != finer || parameter.path == "grid.dx_mm") most = std::max(most, finer / own);
  }
  return most;
}

double bound(const std::vector<double>& errors, double nearness) {
  if (!(nearness < 1)) return unknown;
  double mean = 0, square = 0, largest = 0;
  const auto n = static_cast<double>(errors.size());
  for (const double error : errors) {
    mean += std::abs(error) / n;
    largest = std::max(largest, std::abs(error));
  }
  for (const double error : errors) square += (std::abs(error) - mean) * (std::abs(error) - mean);
  const double deviation = std::sqrt(square / (n - 1));
  return std::max(largest, mean + tolerance_factor(static_cast<int>(errors.size())) * deviation) /
         (1 - nearness);
}

std::vector<std::string> common_lines(const std::vector<std::vector<std::string>>& all) {
  std::vector<std::string> common = all.front();
  for (const auto& lines : all) {
    std::vector<std::string> both;
    std::set_intersection(common.begin(), common.end(), lines.begin(), lines.end(), std::back_inserter(both));
    common = std::move(both);
  }
  return common;
}

}  // namespace

Measurements measurements_of(const Study& study, const WorkPrecision& result) {
  Measurements m;
  m.program = COHORT_VERSION;
  m.study = std::filesystem::path(study.file).filename().string();
  m.device = result.device;
  m.reference = fmt::format("{}", fmt::join(result.design.reference->overrides(), "; "));
  const Campaign base = campaign_of(study, {}, study.file);
  const Campaign reference = campaign_of(study, result.design.reference->overrides(), study.file);
  m.members = static_cast<int>(base.members);
  m.values = own_values(base.scene);
  for (const SampledParameter& sampled : base.parameters)
    m.sampled[sampled.path] = {sampled.distribution.value(0), sampled.distribution.value(1)};

  std::vector<std::vector<std::string>> structures;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const Setting& setting = result.design.settings[i];
    const SettingRun& run = result.runs[i];
    const Campaign campaign = campaign_of(study, setting.overrides(), study.file);
    structures.push_back(scene_structure(campaign.scene));
    for (const auto& [path, value] : setting.values) m.values.erase(path);
    if (!run.outcome.empty()) continue;
    const double near = nearness(campaign, reference);
    MeasuredSetting measured{setting.label, setting.values, run.median_device_s(), {}};
    for (const MeasureErrors& errors : result.errors) {
      if (!find_feature(result.reference.layout.features, errors.name)) continue;  // a norm
      m.features[errors.name] = errors.unit;
      std::vector<double> percent;
      for (std::size_t n = 0; n < errors.of[i].size(); ++n)
        percent.push_back(100 * errors.of[i][n] / errors.reference[n]);
      const bool known = std::none_of(percent.begin(), percent.end(), [](double e) { return std::isnan(e); });
      measured.errors[errors.name] = {errors.rms(i), errors.largest(i),
                                      known ? bound(errors.of[i], near) : unknown,
                                      known ? bound(percent, near) : unknown};
    }
    m.settings.push_back(std::move(measured));
  }
  m.structure = common_lines(structures);
  std::set<std::string> varied;
  for (const auto& lines : structures)
    for (const std::string& line : lines)
      if (!std::binary_search(m.structure.begin(), m.structure.end(), line)) varied.insert(line);
  m.varied.assign(varied.begin(), varied.end());
  std::stable_sort(
      m.settings.begin(), m.settings.end(),
      [](const MeasuredSetting& a, const MeasuredSetting& b) { return a.device_s < b.device_s; });
  return m;
}

}  // namespace cohort
