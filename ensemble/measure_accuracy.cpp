#include "ensemble/measure_accuracy.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>

#include "ensemble/config.hpp"
#include "ensemble/feature_names.hpp"
#include "ensemble/tolerance.hpp"
#include "solver/mechanics.hpp"

namespace cohort {

namespace {

constexpr double unknown = std::numeric_limits<double>::infinity();

/// Lengths, steps and tolerances: the smaller, the finer.
bool is_resolution(const std::string& path) {
  return path.ends_with("dx_mm") || path.ends_with("dt_ms") || path.ends_with("step_factor") ||
         path.ends_with("tolerance") || path.ends_with("until_periodic");
}

/// By path, how fine a scene is.
std::map<std::string, double> resolutions(const Scene& scene) {
  std::map<std::string, double> result;
  for (const Parameter& parameter : scene.parameters.all())
    if (is_resolution(parameter.path))
      result[parameter.path] = parameter.path == "mechanics.dx_mm" ? solid_dx_mm(scene) : parameter.value;
  return result;
}

/// Paths of what is not the same in all of them.
std::set<std::string> differing(const std::vector<std::map<std::string, double>>& all) {
  std::map<std::string, double> first;
  std::set<std::string> result;
  for (const auto& one : all)
    for (const auto& [path, value] : one)
      if (first.emplace(path, value).first->second != value) result.insert(path);
  return result;
}

/// The largest ratio of what the reference has to what the setting has, of what differs in the study.
double largest_ratio(const std::map<std::string, double>& setting,
                     const std::map<std::string, double>& reference, const std::set<std::string>& paths) {
  double most = 0;
  for (const std::string& path : paths) {
    const auto own = setting.find(path), finer = reference.find(path);
    if (own == setting.end() || finer == reference.end()) continue;
    most = std::max(most, own->second > 0 && finer->second > 0 ? finer->second / own->second : unknown);
  }
  return most;
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

double error_bound(const std::vector<double>& errors, double factor, double ratio) {
  if (errors.size() < least_measured || !(ratio < 1)) return unknown;
  const auto n = static_cast<double>(errors.size());
  double mean = 0, square = 0, largest = 0;
  for (const double error : errors) {
    if (!std::isfinite(error)) return unknown;
    mean += error / n;
    largest = std::max(largest, std::abs(error));
  }
  for (const double error : errors) square += (error - mean) * (error - mean);
  return std::max(largest, std::abs(mean) + factor * std::sqrt(square / (n - 1))) / (1 - ratio);
}

void check_measurable(Study& study, const WorkPrecisionDesign& design) {
  Mistakes mistakes;
  const Node* node = study.root.find("measurements");
  const Place place = node ? node->place : study.root.place;
  if (const auto members = campaign_of(study, {}, study.file).members; members < least_measured)
    mistakes.add(place, fmt::format("measurements need {} members at least, to tell how errors spread; "
                                    "campaign.members is {}",
                                    least_measured, members));
  std::set<std::string> others;
  const auto look = [&](const Setting& setting) {
    for (const auto& [path, value] : setting.values)
      if (!is_numerical(path)) others.insert(path);
  };
  for (const Setting& setting : design.settings) look(setting);
  if (design.reference) look(*design.reference);
  for (const std::string& path : others)
    mistakes.add(place, fmt::format("measurements are of {}, not of {}", numerical_paths(), path));
  if (!mistakes.empty()) throw ConfigError(mistakes.lines());
}

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
  m.sampled = sampled_ranges(base);
  const double factor = m.members < least_measured ? 0 : tolerance_factor(m.members, 0.95, 0.9);

  std::vector<Campaign> campaigns;
  std::vector<std::map<std::string, double>> fine;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    campaigns.push_back(campaign_of(study, result.design.settings[i].overrides(), study.file));
    fine.push_back(resolutions(campaigns.back().scene));
  }
  fine.push_back(resolutions(reference.scene));
  const std::set<std::string> counts = differing(fine);
  std::set<std::string> chosen;
  for (const Setting& setting : result.design.settings)
    for (const auto& [path, value] : setting.values) chosen.insert(path);
  for (const std::string& path : chosen) m.values.erase(path);

  std::vector<std::vector<std::string>> structures;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const Setting& setting = result.design.settings[i];
    const SettingRun& run = result.runs[i];
    structures.push_back(scene_structure(campaigns[i].scene));
    if (!run.outcome.empty()) continue;
    const double ratio =
        campaigns[i].sha256 == reference.sha256 ? unknown : largest_ratio(fine[i], fine.back(), counts);
    MeasuredSetting measured{setting.label, setting.values, run.median_device_s(), {}};
    // What only others set it has from the base, and a campaign need not.
    for (const std::string& path : chosen)
      if (std::none_of(setting.values.begin(), setting.values.end(),
                       [&](const auto& entry) { return entry.first == path; }))
        if (const auto value = numerical_value(campaigns[i].scene, path))
          measured.set.emplace_back(path, *value);
    for (const MeasureErrors& errors : result.errors) {
      if (!find_feature(result.reference.layout.features, errors.name)) continue;  // a norm
      m.features[errors.name] = errors.unit;
      std::vector<double> percent;
      for (std::size_t n = 0; n < errors.of[i].size(); ++n)
        percent.push_back(100 * errors.of[i][n] / errors.reference[n]);
      measured.errors[errors.name] = {errors.rms(i), errors.largest(i),
                                      error_bound(errors.of[i], factor, ratio),
                                      error_bound(percent, factor, ratio)};
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
