#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
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

using Difference = std::function<double(const SettingRun& run, const SettingRun& other, std::size_t member)>;

/// How a measure compares two runs, and its unit; no function for what is no norm of a series.
std::pair<Difference, std::string> norm(const std::string& measure) {
  const auto of_series = [](std::vector<float> Recording::*series) {
    return [series](const SettingRun& run, const SettingRun& other, std::size_t m) {
      return relative_percent(run.recordings[m].*series, other.recordings[m].*series);
    };
  };
  if (measure == "ecg") return {of_series(&Recording::ecg), "%"};
  if (measure == "pressure") return {of_series(&Recording::pressure), "%"};
  if (measure == "volume") return {of_series(&Recording::volume), "%"};
  if (measure == "displacement") return {of_series(&Recording::displacement), "%"};
  if (measure == "activation") return {activation_apart, "ms"};
  return {};
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

/// The value of a setting's path as a number; NaN where it is none.
double as_number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return text.empty() || *end != '\0' ? NaN : value;
}

const std::string* find_value(const Setting& setting, const std::string& path) {
  for (const auto& [own, value] : setting.values)
    if (own == path) return &value;
  return nullptr;
}

/// The one path in which two settings differ, or nothing.
std::string only_difference(const Setting& a, const Setting& b) {
  std::string result;
  const auto look = [&](const Setting& from, const Setting& at) {
    for (const auto& [path, value] : from.values) {
      const std::string* other = find_value(at, path);
      if ((other && *other == value) || path == result) continue;
      if (!result.empty()) return false;
      result = path;
    }
    return true;
  };
  return look(a, b) && look(b, a) ? result : std::string();
}

bool is_step(const std::string& path) {
  return path.ends_with("dx_mm") || path.ends_with("dt_ms") || path.ends_with("step_factor");
}

}  // namespace

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
    auto [difference, unit] = norm(measure);
    if (difference && !reference)
      throw std::runtime_error(
          fmt::format("measures: {} is compared with a run, and the reference is values", measure));
    if (!difference && !reference && !known.contains(measure))
      throw std::runtime_error(fmt::format("measures: reference.values has no {}", measure));
    MeasureErrors errors{measure, unit, {}, {}};
    errors.reference = reference_values(measure, runs, difference ? nullptr : reference, known);
    for (const SettingRun& run : runs) {
      std::optional<std::size_t> feature;
      if (!difference) {
        feature = find_feature(run.layout.features, measure);
        if (!feature) throw std::runtime_error("measures: " + no_such_feature(run.layout.features, measure));
        errors.name = run.layout.features[*feature];
        errors.unit = run.layout.feature_units[*feature];
      }
      std::vector<double> own;
      for (std::size_t m = 0; m < run.recordings.size(); ++m) {
        if (run.recordings[m].outcome != Outcome::done) {
          own.push_back(NaN);
        } else if (difference) {
          own.push_back(difference(run, *reference, m));
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

std::vector<bool> pareto_front(const std::vector<double>& time, const std::vector<double>& error) {
  std::vector<bool> front(time.size());
  for (std::size_t i = 0; i < time.size(); ++i) {
    front[i] = !std::isnan(error[i]);
    for (std::size_t j = 0; j < time.size(); ++j)
      if (time[j] <= time[i] && error[j] <= error[i] && (time[j] < time[i] || error[j] < error[i]))
        front[i] = false;
  }
  return front;
}

double distance_to_front(const std::vector<double>& time, const std::vector<double>& error, std::size_t i) {
  if (std::isnan(error[i])) return NaN;
  double least_time = time[i], least_error = error[i];
  for (std::size_t j = 0; j < time.size(); ++j) {
    if (error[j] <= error[i]) least_time = std::min(least_time, time[j]);
    if (time[j] <= time[i] && !std::isnan(error[j])) least_error = std::min(least_error, error[j]);
  }
  const double by_time = time[i] / least_time;
  return error[i] == least_error ? 1 : std::min(by_time, error[i] / least_error);
}

double observed_order(double coarse_error, double fine_error, double coarse_h, double fine_h,
                      double reference_h) {
  const double ratio = coarse_error / fine_error;
  const auto excess = [&](double p) {
    const double own = reference_h > 0 ? std::pow(reference_h, p) : 0;
    return (std::pow(coarse_h, p) - own) / (std::pow(fine_h, p) - own) - ratio;
  };
  double low = 1e-3, high = 8;
  if (!(excess(low) < 0) || !(excess(high) > 0)) return NaN;
  constexpr int bisections = 60;
  for (int k = 0; k < bisections; ++k) (excess((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

std::vector<ObservedOrder> observed_orders(const WorkPrecisionDesign& design,
                                           const std::vector<MeasureErrors>& errors) {
  std::vector<ObservedOrder> result;
  const std::vector<Setting>& all = design.settings;
  for (std::size_t i = 0; i < all.size(); ++i) {
    // The next finer of those that differ in one step alone, for each such step.
    std::map<std::string, std::pair<double, std::size_t>> next;
    for (std::size_t j = 0; j < all.size(); ++j) {
      const std::string path = only_difference(all[i], all[j]);
      if (!is_step(path) || !find_value(all[i], path) || !find_value(all[j], path)) continue;
      const double own = as_number(*find_value(all[i], path)), other = as_number(*find_value(all[j], path));
      if (!(other < own) || !(other > 0)) continue;
      const auto it = next.find(path);
      if (it == next.end() || it->second.first < other) next[path] = {other, j};
    }
    for (const auto& [path, finer] : next) {
      const double own = as_number(*find_value(all[i], path));
      double reference_h = 0;
      if (design.reference)
        if (const std::string* value = find_value(*design.reference, path)) reference_h = as_number(*value);
      if (!(reference_h < finer.first)) continue;
      for (std::size_t m = 0; m < errors.size(); ++m)
        result.push_back(
            {path, i, finer.second, own, finer.first, m,
             observed_order(errors[m].rms(i), errors[m].rms(finer.second), own, finer.first, reference_h)});
    }
  }
  return result;
}

std::vector<RoundingShare> rounding_shares(const WorkPrecisionDesign& design,
                                           const std::vector<SettingRun>& runs,
                                           const std::vector<MeasureErrors>& errors) {
  std::vector<RoundingShare> result;
  const std::vector<Setting>& all = design.settings;
  const auto precision = [&](std::size_t i) {
    const std::string* value = find_value(all[i], "precision");
    return value ? *value : std::string("single");
  };
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = 0; j < all.size(); ++j) {
      if (precision(i) != "single" || precision(j) != "double") continue;
      if (only_difference(all[i], all[j]) != "precision") continue;
      if (!runs[i].outcome.empty() || !runs[j].outcome.empty()) continue;
      std::vector<std::string> names;
      for (const MeasureErrors& error : errors) names.push_back(error.name);
      const std::vector<MeasureErrors> apart = measure_errors(names, {runs[i]}, &runs[j], {});
      for (std::size_t m = 0; m < errors.size(); ++m)
        result.push_back({i, j, m, apart[m].rms(0), apart[m].rms(0) / errors[m].rms(i)});
    }
  return result;
}

}  // namespace cohort
