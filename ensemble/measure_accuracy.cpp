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
#include "ensemble/work_precision_design.hpp"
#include "solver/mechanics.hpp"

namespace cohort {

namespace {

constexpr double unknown = std::numeric_limits<double>::infinity();

/// Lengths, steps and tolerances: the smaller, the finer.
bool is_resolution(const std::string& path) {
  return is_step(path) || path.ends_with("tolerance") || path.ends_with("until_periodic");
}

/// By path, how fine a scene is.
std::map<std::string, double> resolutions(const Scene& scene) {
  std::map<std::string, double> result;
  for (const Parameter& parameter : scene.parameters.all())
    if (is_resolution(parameter.path))
      result[parameter.path] = parameter.path == "mechanics.dx_mm" ? solid_dx_mm(scene) : parameter.value;
  return result;
}

/// The same, with the step that was chosen where the scene leaves it open (0): of the members the largest.
std::map<std::string, double> resolutions(const Scene& scene, const std::vector<Recording>& recordings) {
  std::map<std::string, double> result = resolutions(scene);
  const auto step = result.find("time.dt_ms");
  if (step == result.end() || step->second > 0 || scene.mechanics) return result;
  for (const Recording& recording : recordings)
    step->second = std::max(step->second, static_cast<double>(recording.dt_ms));
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

/// Two settings, by their places.
struct Pair {
  std::size_t coarse, fine;
};

/// By path, the settings that ended and differ in this step alone, by a factor of 2 or more.
std::map<std::string, std::vector<Pair>> pairs_of(const std::vector<Campaign>& campaigns,
                                                  const std::vector<SettingRun>& runs) {
  constexpr double least_factor = 2 - 1e-9;
  std::vector<ResolvedSetting> settings;
  for (const Campaign& campaign : campaigns) settings.push_back(resolved(campaign));
  std::map<std::string, std::vector<Pair>> result;
  for (std::size_t i = 0; i < settings.size(); ++i)
    for (std::size_t j = 0; j < settings.size(); ++j) {
      if (!runs[i].outcome.empty() || !runs[j].outcome.empty()) continue;
      const auto apart = coarsening(settings[i], settings[j]);
      if (apart && apart->paths.size() == 1 && apart->factor >= least_factor)
        result[apart->paths.front()].push_back({i, j});
    }
  return result;
}

/// Whether a feature is the same, to a thousandth of its error, in all pairs.
bool is_unaffected(const MeasureErrors& errors, const std::vector<Pair>& pairs) {
  constexpr double same = 1e-3;
  for (const auto& [coarse, fine] : pairs) {
    const double most = same * std::max(errors.rms(coarse), errors.rms(fine));
    for (std::size_t n = 0; n < errors.of[coarse].size(); ++n)
      if (!(std::abs(errors.of[coarse][n] - errors.of[fine][n]) <= most)) return false;
  }
  return !pairs.empty();
}

/// What a study knows of how its reference is off.
class ReferenceErrors {
 public:
  ReferenceErrors(const std::vector<Campaign>& campaigns, const std::vector<SettingRun>& runs,
                  const Scene& scene, const SettingRun& reference)
      : pairs_(pairs_of(campaigns, runs)), reference_(resolutions(scene, reference.recordings)) {
    for (std::size_t i = 0; i < campaigns.size(); ++i)
      settings_.push_back(resolutions(campaigns[i].scene, runs[i].recordings));
    std::vector<std::map<std::string, double>> all = settings_;
    all.push_back(reference_);
    paths_ = differing(all);
  }

  std::vector<std::string> paths() const { return {paths_.begin(), paths_.end()}; }

  /// The largest shortfall of a setting's errors by a feature, of all lengths, steps and tolerances that
  /// differ.
  double shortfall_of(std::size_t setting, const MeasureErrors& errors) const {
    double most = 1;
    for (const std::string& path : paths_) {
      const auto own = settings_[setting].find(path), finer = reference_.find(path);
      if (own == settings_[setting].end() || finer == reference_.end()) continue;
      if (!(own->second > 0 && finer->second > 0)) return unknown;
      const auto found = pairs_.find(path);
      const std::vector<Pair> pairs = found == pairs_.end() ? std::vector<Pair>() : found->second;
      if (finer->second < own->second && is_unaffected(errors, pairs)) continue;
      most = std::max(most, shortfall(finer->second / own->second, order(path, pairs, errors)));
    }
    return most;
  }

 private:
  /// The least that a pair shows, from 1 to 2.
  double order(const std::string& path, const std::vector<Pair>& pairs, const MeasureErrors& errors) const {
    double least = pairs.empty() ? 1 : 2;
    for (const auto& [coarse, fine] : pairs) {
      const double seen = observed_order(errors.rms(coarse), errors.rms(fine), settings_[coarse].at(path),
                                         settings_[fine].at(path), reference_.at(path));
      least = std::min(least, std::isnan(seen) ? 1 : seen);
    }
    return std::max(least, 1.0);
  }

  std::map<std::string, std::vector<Pair>> pairs_;
  std::map<std::string, double> reference_;
  std::vector<std::map<std::string, double>> settings_;
  std::set<std::string> paths_;
};

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

double shortfall(double ratio, double order) {
  if (!(ratio < 1)) return unknown;
  constexpr double safety = 2;
  const double share = std::pow(ratio, order);
  return std::min(1 / (1 - ratio), 1 + safety * share / (1 - share));
}

double error_bound(const std::vector<double>& errors, double factor, double short_by) {
  if (errors.size() < least_measured || !std::isfinite(short_by)) return unknown;
  const auto n = static_cast<double>(errors.size());
  double mean = 0, square = 0, largest = 0;
  for (const double error : errors) {
    if (!std::isfinite(error)) return unknown;
    mean += error / n;
    largest = std::max(largest, std::abs(error));
  }
  for (const double error : errors) square += (error - mean) * (error - mean);
  return std::max(largest, std::abs(mean) + factor * std::sqrt(square / (n - 1))) * short_by;
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
  for (std::size_t i = 0; i < result.runs.size(); ++i)
    campaigns.push_back(campaign_of(study, result.design.settings[i].overrides(), study.file));
  const ReferenceErrors reference_errors(campaigns, result.runs, reference.scene, result.reference);
  m.counted = reference_errors.paths();
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
    const bool is_reference = campaigns[i].sha256 == reference.sha256;
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
      const double short_by = is_reference ? unknown : reference_errors.shortfall_of(i, errors);
      measured.errors[errors.name] = {errors.rms(i), errors.largest(i),
                                      error_bound(errors.of[i], factor, short_by),
                                      error_bound(percent, factor, short_by)};
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
