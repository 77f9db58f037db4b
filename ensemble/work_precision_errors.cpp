#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>

#include "ensemble/feature_names.hpp"
#include "ensemble/work_precision_runs.hpp"

namespace cohort {

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// Root mean square of the difference over that of the reference, in %; NaN where the shapes differ.
double relative_percent(const std::vector<float>& series, const std::vector<float>& reference) {
  if (series.size() != reference.size() || series.empty()) return NaN;
  double apart = 0, all = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double difference = static_cast<double>(series[i]) - static_cast<double>(reference[i]);
    apart += difference * difference;
    all += static_cast<double>(reference[i]) * static_cast<double>(reference[i]);
  }
  return 100 * std::sqrt(apart / all);
}

bool is_activation_time(const std::string& name) {
  return name.starts_with("activation_") && name.ends_with("_ms");
}

/// Mean absolute difference of all activation times, ms.
double activation_apart(const SettingRun& run, const SettingRun& reference, std::size_t member) {
  double sum = 0;
  int count = 0;
  for (std::size_t f = 0; f < run.layout.features.size(); ++f) {
    if (!is_activation_time(run.layout.features[f])) continue;
    const auto there = find_feature(reference.layout.features, run.layout.features[f]);
    if (!there) return NaN;
    const double own = static_cast<double>(run.recordings[member].features[f]);
    const double other = static_cast<double>(reference.recordings[member].features[*there]);
    if (std::isnan(own) && std::isnan(other)) continue;  // neither is reached
    sum += std::abs(own - other);
    ++count;
  }
  return count == 0 ? NaN : sum / count;
}

/// How a measure that is no feature compares two runs.
struct Norm {
  std::string unit;
  std::function<double(const SettingRun& run, const SettingRun& other, std::size_t member)> difference;
  bool (*recorded)(const Layout& layout);
};

const std::map<std::string, Norm>& norms() {
  const auto of_series = [](std::vector<float> Recording::*series) {
    return [series](const SettingRun& run, const SettingRun& other, std::size_t m) {
      return relative_percent(run.recordings[m].*series, other.recordings[m].*series);
    };
  };
  const auto ecg = [](const Layout& layout) { return !layout.leads.empty(); };
  const auto pv = [](const Layout& layout) { return !layout.compartments.empty(); };
  const auto displacement = [](const Layout& layout) { return !layout.points.empty(); };
  const auto activation = [](const Layout& layout) {
    return std::any_of(layout.features.begin(), layout.features.end(), is_activation_time);
  };
  static const std::map<std::string, Norm> all = {
      {"ecg", {"%", of_series(&Recording::ecg), ecg}},
      {"pressure", {"%", of_series(&Recording::pressure), pv}},
      {"volume", {"%", of_series(&Recording::volume), pv}},
      {"displacement", {"%", of_series(&Recording::displacement), displacement}},
      {"activation", {"ms", activation_apart, activation}}};
  return all;
}

double value_of(const SettingRun& run, std::size_t feature, std::size_t member) {
  return static_cast<double>(run.recordings[member].features[feature]);
}

/// (N) of a feature; NaN for a norm, which has neither.
std::vector<double> reference_values(const std::string& measure, const std::vector<SettingRun>& runs,
                                     const SettingRun* reference,
                                     const std::map<std::string, double>& known) {
  const std::size_t members = runs.empty() ? 0 : runs.front().recordings.size();
  if (const auto given = known.find(measure); given != known.end())
    return std::vector<double>(members, given->second);
  std::vector<double> result(members, NaN);
  if (!reference) return result;
  if (const auto there = find_feature(reference->layout.features, measure))
    for (std::size_t m = 0; m < members; ++m) result[m] = value_of(*reference, *there, m);
  return result;
}

}  // namespace

bool is_norm(const std::string& measure) {
  return norms().contains(measure);
}

std::optional<std::string> measure_name(const std::string& measure, const Layout& layout) {
  if (is_norm(measure)) return norms().at(measure).recorded(layout) ? std::optional(measure) : std::nullopt;
  const auto feature = find_feature(layout.features, measure);
  return feature ? std::optional(layout.features[*feature]) : std::nullopt;
}

double MeasureErrors::rms(std::size_t setting) const {
  double sum = 0;
  for (const double error : of[setting]) sum += error * error;
  return std::sqrt(sum / static_cast<double>(of[setting].size()));
}

double MeasureErrors::largest(std::size_t setting) const {
  double most = 0;
  for (const double error : of[setting]) {
    if (std::isnan(error)) return NaN;
    most = std::max(most, std::abs(error));
  }
  return most;
}

std::vector<MeasureErrors> measure_errors(const std::vector<std::string>& measures,
                                          const std::vector<SettingRun>& runs, const SettingRun* reference,
                                          const std::map<std::string, double>& known) {
  std::vector<MeasureErrors> result;
  for (const std::string& measure : measures) {
    const Norm* norm = is_norm(measure) ? &norms().at(measure) : nullptr;
    if (norm && !reference)
      throw std::runtime_error(
          fmt::format("measures: {} is compared with a run, and the reference is values", measure));
    if (!norm && !reference && !known.contains(measure))
      throw std::runtime_error(fmt::format("measures: reference.values has no {}", measure));
    MeasureErrors errors{measure, norm ? norm->unit : "", {}, {}};
    errors.reference = reference_values(measure, runs, norm ? nullptr : reference, known);
    for (const SettingRun& run : runs) {
      std::optional<std::size_t> feature;
      if (!norm) {
        feature = find_feature(run.layout.features, measure);
        if (!feature) throw std::runtime_error("measures: " + no_such_feature(run.layout.features, measure));
        errors.name = run.layout.features[*feature];
        errors.unit = run.layout.feature_units[*feature];
      }
      std::vector<double> own;
      for (std::size_t m = 0; m < run.recordings.size(); ++m) {
        if (run.recordings[m].outcome != Outcome::done) {
          own.push_back(NaN);
        } else if (norm) {
          own.push_back(norm->difference(run, *reference, m));
        } else {
          own.push_back(value_of(run, *feature, m) - errors.reference[m]);
        }
      }
      errors.of.push_back(std::move(own));
    }
    result.push_back(std::move(errors));
  }
  return result;
}

FrontDistance distance_to_front(const std::vector<Seconds>& time, const std::vector<double>& error,
                                std::size_t i) {
  if (std::isnan(error[i]) || std::isnan(time[i].median)) return {NaN, NaN, NaN};
  constexpr double same_error = 1e-3;
  FrontDistance result{1, 1, 1};
  for (std::size_t j = 0; j < time.size(); ++j) {
    if (std::isnan(error[j]) || std::isnan(time[j].median)) continue;
    const double noise = std::max(time[i].most - time[i].least, time[j].most - time[j].least);
    const bool as_exact = std::abs(error[i] - error[j]) <= same_error * std::max(error[i], error[j]);
    const bool as_fast = std::abs(time[i].median - time[j].median) <= noise;
    const bool no_slower = time[j].median <= time[i].median;
    if (!no_slower || !(as_exact || error[j] < error[i])) continue;
    const double slower = as_fast ? 1 : time[i].median / time[j].median;
    const double worse = as_exact ? 1 : error[i] / error[j];
    result.slower = std::max(result.slower, slower);
    result.worse = std::max(result.worse, worse);
    // What is equal does not count; of two advantages the smaller.
    const double by = as_exact ? slower : as_fast ? worse : std::min(slower, worse);
    result.factor = std::max(result.factor, by);
  }
  return result;
}

}  // namespace cohort
