#include "ensemble/accuracy.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "ensemble/config.hpp"
#include "ensemble/feature_names.hpp"
#include "ensemble/measurements.hpp"
#include "ensemble/read_values.hpp"
#include "solver/simulation.hpp"

namespace cohort {

namespace {

bool holds(const std::vector<std::string>& lines, const std::string& line) {
  return std::find(lines.begin(), lines.end(), line) != lines.end();
}

/// Why measurements are not of this scene; empty where they are.
std::string other_scene(const Measurements& measurements, const Scene& scene) {
  const std::vector<std::string> own = scene_structure(scene);
  for (const std::string& line : measurements.structure)
    if (!holds(own, line)) return fmt::format("it was measured with \"{}\"", line);
  for (const std::string& line : own)
    if (!holds(measurements.structure, line) && !holds(measurements.varied, line))
      return fmt::format("it was measured without \"{}\"", line);
  return {};
}

Measurements find_measurements(const Campaign& campaign) {
  const Accuracy& accuracy = campaign.accuracy;
  if (!accuracy.measurements.empty()) {
    Measurements result = read_measurements(read_campaign_file(accuracy.measurements), accuracy.measurements);
    if (const std::string why = other_scene(result, campaign.scene); !why.empty())
      throw ConfigError({fmt::format("{}: {} is of another scene: {}", accuracy.where, result.file, why)});
    return result;
  }
  std::string whys;
  for (const auto& [name, text] : built_in_measurements()) {
    Measurements result = read_measurements(text, name);
    const std::string why = other_scene(result, campaign.scene);
    if (why.empty()) return result;
    whys += fmt::format("; {}: {}", name, why);
  }
  throw ConfigError({fmt::format(
      "{}: nobody has measured such a scene; `cohort study` does, and accuracy.measurements names its file{}",
      accuracy.where, whys)});
}

using Range = std::pair<double, double>;

/// "3", or "1 to 4".
std::string told(const Range& range) {
  return range.first == range.second ? fmt::format("{:.6g}", range.first)
                                     : fmt::format("{:.6g} to {:.6g}", range.first, range.second);
}

/// The range over all members, of each parameter that is set or has a default.
std::map<std::string, Range> ranges_of(const Campaign& campaign) {
  std::map<std::string, Range> result = sampled_ranges(campaign);
  for (const Parameter& parameter : campaign.scene.parameters.all())
    if (!std::isnan(parameter.value)) result.emplace(parameter.path, Range{parameter.value, parameter.value});
  return result;
}

/// The same of the members that were measured, where their scene has what the campaign's has.
std::map<std::string, Range> ranges_of(const Measurements& measurements, const Scene& scene) {
  std::map<std::string, Range> result = measurements.sampled;
  for (const auto& [path, value] : measurements.values) result.emplace(path, Range{value, value});
  const ParameterTable defaults = default_parameters(scene);
  for (const Parameter& parameter : defaults.all())
    if (!std::isnan(parameter.value)) result.emplace(parameter.path, Range{parameter.value, parameter.value});
  return result;
}

/// What the campaign has beyond what was measured, a line for each path.
std::vector<std::string> beyond(const Measurements& measurements, const Campaign& campaign) {
  std::set<std::string> aside;
  for (const MeasuredSetting& setting : measurements.settings)
    for (const auto& [path, value] : setting.set) aside.insert(path);
  const std::map<std::string, Range> own = ranges_of(campaign),
                                     measured = ranges_of(measurements, campaign.scene);
  std::vector<std::string> result;
  const auto told_of = [](const std::map<std::string, Range>& ranges, const std::string& path) {
    const auto it = ranges.find(path);
    return it == ranges.end() ? "not set" : told(it->second);
  };
  for (const Parameter& parameter : campaign.scene.parameters.all()) {
    const std::string& path = parameter.path;
    if (aside.contains(path) || path.starts_with("outputs.")) continue;
    const auto here = own.find(path), there = measured.find(path);
    if (here == own.end() && there == measured.end()) continue;
    if (here != own.end() && there != measured.end() && here->second.first >= there->second.first &&
        here->second.second <= there->second.second)
      continue;
    result.push_back(fmt::format("{} is {}, measured {}", path, told_of(own, path), told_of(measured, path)));
  }
  return result;
}

/// What the bounds do not cover.
std::vector<std::string> warnings(const Measurements& measurements, const Campaign& campaign) {
  std::vector<std::string> result;
  if (measurements.program != COHORT_VERSION)
    result.push_back(fmt::format("accuracy: {} was measured with cohort {}, this is {}: errors may differ",
                                 measurements.file, measurements.program, COHORT_VERSION));
  const bool no_loop = campaign.scene.activation_method == ActivationMethod::eikonal;
  std::vector<std::string> missing;
  for (const Parameter& parameter : campaign.scene.parameters.all())
    if ((parameter.path.ends_with("dx_mm") || (parameter.path.ends_with("dt_ms") && !no_loop)) &&
        !holds(measurements.counted, parameter.path))
      missing.push_back(parameter.path);
  if (!missing.empty())
    result.push_back(
        fmt::format("accuracy: the bounds leave out the errors of {}, which the study did not vary",
                    fmt::join(missing, ", ")));
  for (const std::string& line : beyond(measurements, campaign))
    result.push_back(fmt::format("accuracy: the bounds do not cover it: {}", line));
  return result;
}

struct Asked {
  std::string feature, unit;
  AccuracyWish wish;
};

std::vector<Asked> asked_for(const Measurements& measurements, const Campaign& campaign) {
  const Accuracy& accuracy = campaign.accuracy;
  const Layout own = layout(campaign.scene);
  std::vector<std::string> names;
  for (const auto& [name, unit] : measurements.features) names.push_back(name);
  std::vector<Asked> result;
  std::vector<std::string> mistakes;
  for (const AccuracyWish& wish : accuracy.wishes) {
    const auto place = find_feature(names, wish.feature);
    if (!place) {
      mistakes.push_back(fmt::format("{}: accuracy.{}; measured in {}", accuracy.where,
                                     no_such_feature(names, wish.feature), measurements.file));
      continue;
    }
    if (std::any_of(result.begin(), result.end(),
                    [&](const Asked& asked) { return asked.feature == names[*place]; }))
      mistakes.push_back(fmt::format("{}: accuracy.{} stands there twice", accuracy.where, names[*place]));
    const std::string& unit = measurements.features.at(names[*place]);
    const auto here = std::find(own.features.begin(), own.features.end(), names[*place]);
    if (here != own.features.end())
      if (const auto& is = own.feature_units[static_cast<std::size_t>(here - own.features.begin())];
          is != unit)
        mistakes.push_back(
            fmt::format("{}: {} is in {}, here it is in {}", measurements.file, names[*place], unit, is));
    if (!wish.unit.empty() && wish.unit != "%" && wish.unit != unit)
      mistakes.push_back(fmt::format("{}: accuracy.{} is in {}; the feature is in {} (or %)", accuracy.where,
                                     wish.feature, wish.unit, unit));
    result.push_back({names[*place], unit, wish});
  }
  if (!mistakes.empty()) throw ConfigError(mistakes);
  return result;
}

/// Bound of a setting in the unit of the wish.
double bound_of(const MeasuredSetting& setting, const Asked& asked) {
  const auto error = setting.errors.find(asked.feature);
  if (error == setting.errors.end()) return std::numeric_limits<double>::infinity();
  return asked.wish.unit == "%" ? error->second.bound_percent : error->second.bound;
}

std::string unit_of(const Asked& asked) {
  return asked.wish.unit.empty() ? asked.unit : asked.wish.unit;
}

}  // namespace

void read_accuracy(Node& map, const std::string& file, Accuracy& accuracy, Mistakes& mistakes) {
  accuracy.where = fmt::format("{}:{}:{}", map.place.file, map.place.line, map.place.column);
  if (Node* node = take(map, "measurements"))
    if (const auto name = read_text(*node, "accuracy.measurements", mistakes))
      accuracy.measurements = (std::filesystem::path(file).parent_path() / *name).lexically_normal().string();
  for (Node::Entry& entry : map.entries) {
    if (entry.key == "measurements") continue;
    map.known.insert(entry.key);
    entry.value.read = true;
    const std::string& text = entry.value.text;
    double error = 0;
    const char* end = text.data();
    if (entry.value.kind == Node::Kind::scalar)
      end = std::from_chars(text.data(), text.data() + text.size(), error).ptr;
    if (end == text.data() || !std::isfinite(error) || !(error > 0)) {
      mistakes.add(entry.value.place,
                   fmt::format("accuracy.{} is an error above 0 such as \"1 %\" or \"3 ms\", {}", entry.key,
                               found(entry.value)));
      continue;
    }
    std::string unit = end;
    unit.erase(0,
               unit.find_first_not_of(' ') == std::string::npos ? unit.size() : unit.find_first_not_of(' '));
    if (unit == "percent") unit = "%";
    accuracy.wishes.push_back({entry.key, error, unit});
  }
  if (accuracy.wishes.empty() && mistakes.empty())
    mistakes.add(map.place, "accuracy names no feature: {LV_EF: 1 %, QRS: 3 ms}, say");
}

AccuracyChoice choose_setting(const Campaign& campaign) {
  const Measurements measurements = find_measurements(campaign);
  const std::vector<Asked> all = asked_for(measurements, campaign);
  std::vector<const MeasuredSetting*> sorted;
  for (const MeasuredSetting& setting : measurements.settings) sorted.push_back(&setting);
  std::stable_sort(sorted.begin(), sorted.end(), [](const MeasuredSetting* a, const MeasuredSetting* b) {
    return a->device_s < b->device_s;
  });
  AccuracyChoice choice;
  std::vector<std::string> refused;
  for (const MeasuredSetting* setting : sorted) {
    std::vector<std::string> bounds;
    bool meets = true;
    for (const Asked& asked : all) {
      const double bound = bound_of(*setting, asked);
      meets = meets && bound <= asked.wish.error;
      bounds.push_back(std::isfinite(bound)
                           ? fmt::format("{} {:.3g} {}", asked.feature, bound, unit_of(asked))
                           : fmt::format("{} not known", asked.feature));
    }
    const std::string told = fmt::format("{} ({:.3g} s a member on {}): {}", setting->label,
                                         setting->device_s, measurements.device, fmt::join(bounds, ", "));
    if (!meets) {
      refused.push_back(told);
      continue;
    }
    for (const auto& [path, value] : setting->set) choice.overrides.push_back(path + "=" + value);
    choice.places = setting->places;
    choice.lines.push_back(fmt::format("accuracy: {}, the cheapest that meets it of {} measured in {}", told,
                                       sorted.size(), measurements.file));
    for (const std::string& line : refused) choice.lines.push_back("accuracy: too coarse is " + line);
    choice.warnings = warnings(measurements, campaign);
    return choice;
  }
  std::vector<std::string> lines = {fmt::format(
      "{}: no setting measured in {} is as accurate as asked for; they have, for 95 % of members:",
      campaign.accuracy.where, measurements.file)};
  lines.insert(lines.end(), refused.begin(), refused.end());
  throw ConfigError(lines);
}

}  // namespace cohort
