#include "ensemble/measurements.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "ensemble/config.hpp"
#include "ensemble/identity.hpp"
#include "ensemble/members.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/study.hpp"
#include "solver/mechanics.hpp"

namespace cohort {

extern const std::map<std::string, std::string> embedded_measurements;

namespace {

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string list(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "  - " + quoted(line) + "\n";
  return text.empty() ? " []\n" : "\n" + text;
}

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "unknown";
}

Node* require(Node& map, const std::string& key, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) mistakes.add(map.place, fmt::format("\"{}\" is missing", key));
  return node;
}

/// A number that is not negative.
double read_amount(Node& node, const std::string& key, Mistakes& mistakes) {
  const double value = read_number(node, key, "", mistakes).value_or(0);
  if (value < 0) mistakes.add(node.place, fmt::format("{} is {}; it is not below 0", key, value));
  return value;
}

/// The same, or infinity where "unknown" stands.
double read_bound(Node& map, const std::string& key, Mistakes& mistakes) {
  Node* node = require(map, key, mistakes);
  if (!node) return 0;
  if (node->kind == Node::Kind::scalar && node->text == "unknown") {
    node->read = true;
    return std::numeric_limits<double>::infinity();
  }
  return read_amount(*node, key, mistakes);
}

std::string read_line(Node& root, const std::string& key, Mistakes& mistakes) {
  Node* node = require(root, key, mistakes);
  return node ? read_text(*node, key, mistakes).value_or("") : "";
}

std::vector<std::string> read_lines(Node& root, const std::string& key, Mistakes& mistakes) {
  Node* node = require(root, key, mistakes);
  if (!node) return {};
  if (node->kind == Node::Kind::sequence && node->items.empty()) {
    node->read = true;
    return {};
  }
  return read_texts(*node, key, mistakes).value_or(std::vector<std::string>());
}

MeasuredSetting read_setting(Node& map, const std::map<std::string, std::string>& features,
                             Mistakes& mistakes) {
  MeasuredSetting setting{};
  setting.label = read_line(map, "label", mistakes);
  if (Node* seconds = require(map, "device_s", mistakes))
    setting.device_s = read_amount(*seconds, "device_s", mistakes);
  if (Node* set = require_map(map, "set", mistakes)) {
    set->read = true;
    for (const Node::Entry& entry : set->entries) {
      if (!is_numerical(entry.key))
        mistakes.add(entry.place, fmt::format("set is of {}, not of {}", numerical_paths(), entry.key));
      setting.set.emplace_back(entry.key, flow_text(entry.value));
      setting.places.push_back(entry.place);
    }
  }
  if (Node* errors = require_map(map, "errors", mistakes)) {
    errors->read = true;
    for (Node::Entry& entry : errors->entries) {
      if (!features.contains(entry.key))
        mistakes.add(entry.place, fmt::format("{} is not among the features", entry.key));
      if (!expect_map(entry.value, entry.key, mistakes)) continue;
      MeasuredError error{};
      error.rms = read_bound(entry.value, "rms", mistakes);
      error.largest = read_bound(entry.value, "largest", mistakes);
      error.bound = read_bound(entry.value, "bound", mistakes);
      error.bound_percent = read_bound(entry.value, "bound_percent", mistakes);
      check_keys(entry.value, {}, mistakes);
      setting.errors[entry.key] = error;
    }
  }
  check_keys(map, {}, mistakes);
  return setting;
}

}  // namespace

std::vector<std::string> scene_structure(const Scene& scene) {
  std::istringstream text(structure_text(scene));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  std::sort(lines.begin(), lines.end());
  return lines;
}

ParameterTable default_parameters(const Scene& scene) {
  Scene bare = scene;
  bare.parameters = {};
  if (bare.geometry != GeometryKind::shapes) bare.regions.clear();
  declare_parameters(bare);
  return bare.parameters;
}

std::map<std::string, double> own_values(const Scene& scene) {
  const ParameterTable bare = default_parameters(scene);
  std::map<std::string, double> result;
  for (const Parameter& parameter : scene.parameters.all()) {
    const int place = bare.find(parameter.path);
    const double usual = place < 0 ? inherited : bare[place].value;
    if (!std::isnan(parameter.value) && parameter.value != usual) result[parameter.path] = parameter.value;
  }
  return result;
}

std::map<std::string, std::pair<double, double>> sampled_ranges(const Campaign& campaign) {
  std::map<std::string, std::pair<double, double>> result;
  for (const auto& [path, distribution] : campaign.parameters) {
    constexpr double tail = 0.01;
    const double out = distribution.kind == Distribution::Kind::normal ? tail : 0;
    result[path] = {distribution.value(out), distribution.value(1 - out)};
    if (distribution.kind != Distribution::Kind::choice) continue;
    const auto [low, high] = std::minmax_element(distribution.choices.begin(), distribution.choices.end());
    result[path] = {*low, *high};
  }
  if (campaign.method != Method::csv && campaign.method != Method::table) return result;
  const Samples points = sample(campaign);
  for (std::size_t i = 0; i < points.physical.size(); ++i) {
    const double value = points.physical[i];
    const auto it = result.emplace(points.paths[i % points.paths.size()], std::pair(value, value)).first;
    it->second = {std::min(it->second.first, value), std::max(it->second.second, value)};
  }
  return result;
}

namespace {

constexpr std::array numerical = {"grid.dx_mm",
                                  "mechanics.dx_mm",
                                  "torso.dx_mm",
                                  "time.dt_ms",
                                  "time.step_factor",
                                  "time.beats.until_periodic",
                                  "time.beats.at_most",
                                  "mechanics.step_factor",
                                  "mechanics.drive_beats",
                                  "mechanics.load.tolerance",
                                  "circulation.dt_ms",
                                  "electrophysiology.elliptic_tolerance",
                                  "electrophysiology.activation",
                                  "electrophysiology.splitting",
                                  "precision"};

}  // namespace

bool is_numerical(const std::string& path) {
  return std::find(numerical.begin(), numerical.end(), path) != numerical.end();
}

std::optional<std::string> numerical_value(const Scene& scene, const std::string& path) {
  if (path == "precision") return scene.precision == Precision::double_ ? "double" : "single";
  if (path == "electrophysiology.activation") return method_name(scene.activation_method);
  if (path == "electrophysiology.splitting")
    return scene.splitting == Splitting::godunov ? "godunov" : "strang";
  if (path == "mechanics.dx_mm" && scene.mechanics) return fmt::format("{}", solid_dx_mm(scene));
  const int place = scene.parameters.find(path);
  if (place < 0 || std::isnan(scene.parameters[place].value)) return {};
  return fmt::format("{}", scene.parameters[place].value);
}

std::string numerical_paths() {
  return fmt::format("{}", fmt::join(numerical, ", "));
}

std::string measurements_text(const Measurements& m) {
  std::string text = fmt::format(
      "# Measured by `cohort study`; `accuracy:` of a campaign chooses from it. Errors are in a feature's "
      "unit; bounds hold for\n"
      "# 95 % of members like those measured, with a confidence of 90 % where errors are normally "
      "distributed, "
      "and count what the\n# reference itself is off, but nothing of lengths and steps that the study does "
      "not "
      "vary.\n"
      "version: {}\nprogram: {}\nstudy: {}\ndevice: {}\nreference: {}\nmembers: {}\n",
      Measurements::version, quoted(m.program), quoted(m.study), quoted(m.device), quoted(m.reference),
      m.members);
  text += "structure:" + list(m.structure) + "varied:" + list(m.varied) + "counted:" + list(m.counted);
  const auto map = [&](const char* name, const auto& entries, const auto& value) {
    text += fmt::format("{}:{}\n", name, entries.empty() ? " {}" : "");
    for (const auto& entry : entries) text += fmt::format("  {}: {}\n", entry.first, value(entry.second));
  };
  map("values", m.values, [](double value) { return fmt::format("{}", value); });
  map("sampled", m.sampled, [](const std::pair<double, double>& range) {
    return fmt::format("[{}, {}]", range.first, range.second);
  });
  map("features", m.features, [](const std::string& unit) { return quoted(unit); });
  text += "settings:\n";
  for (const MeasuredSetting& setting : m.settings) {
    std::vector<std::string> set;
    for (const auto& [path, value] : setting.set) set.push_back(path + ": " + value);
    text += fmt::format("  - label: {}\n    set: {{{}}}\n    device_s: {}\n    errors:\n",
                        quoted(setting.label), fmt::join(set, ", "), number(setting.device_s));
    for (const auto& [feature, error] : setting.errors)
      text += fmt::format("      {}: {{rms: {}, largest: {}, bound: {}, bound_percent: {}}}\n", feature,
                          number(error.rms), number(error.largest), number(error.bound),
                          number(error.bound_percent));
  }
  return text;
}

Measurements read_measurements(const std::string& text, const std::string& file) {
  Mistakes mistakes;
  Measurements result;
  result.file = file;
  Node root = parse_document(text, file, mistakes);
  if (root.kind != Node::Kind::map) {
    if (mistakes.empty()) mistakes.add({file, 1, 1}, "these are no measurements of a study");
    throw ConfigError(mistakes.lines());
  }
  name_levels(root, "");
  if (Node* version = require(root, "version", mistakes))
    if (const auto number = read_whole(*version, "version", 1, mistakes);
        number && *number != Measurements::version)
      // What follows may mean something else.
      throw ConfigError({fmt::format(
          "{}:{}: measurements of version {}; this program reads version {}: run the study again", file,
          version->place.line, *number, Measurements::version)});
  result.program = read_line(root, "program", mistakes);
  result.study = read_line(root, "study", mistakes);
  result.device = read_line(root, "device", mistakes);
  result.reference = read_line(root, "reference", mistakes);
  if (Node* members = require(root, "members", mistakes))
    result.members = static_cast<int>(std::min<std::int64_t>(
        most_members, read_whole(*members, "members", least_measured, mistakes).value_or(0)));
  result.structure = read_lines(root, "structure", mistakes);
  result.varied = read_lines(root, "varied", mistakes);
  result.counted = read_lines(root, "counted", mistakes);
  if (Node* values = require_map(root, "values", mistakes)) {
    values->read = true;
    for (Node::Entry& entry : values->entries)
      if (const auto value = read_number(entry.value, entry.key, "", mistakes))
        result.values[entry.key] = *value;
  }
  if (Node* sampled = require_map(root, "sampled", mistakes)) {
    sampled->read = true;
    for (Node::Entry& entry : sampled->entries)
      if (const auto range = read_numbers(entry.value, entry.key, "", 2, mistakes)) {
        result.sampled[entry.key] = {(*range)[0], (*range)[1]};
        if (!((*range)[0] <= (*range)[1]))
          mistakes.add(entry.place, fmt::format("{} is a range from low to high", entry.key));
      }
  }
  if (Node* features = require_map(root, "features", mistakes)) {
    features->read = true;
    for (Node::Entry& entry : features->entries)
      if (const auto unit = read_text(entry.value, entry.key, mistakes)) result.features[entry.key] = *unit;
  }
  if (Node* settings = take(root, "settings"); settings && settings->kind == Node::Kind::sequence) {
    settings->read = true;
    for (Node& setting : settings->items)
      if (expect_map(setting, "a setting", mistakes))
        result.settings.push_back(read_setting(setting, result.features, mistakes));
  } else {
    mistakes.add(root.place, "\"settings\" is a list of what was measured");
  }
  check_keys(root, {}, mistakes);
  if (!mistakes.empty()) throw ConfigError(mistakes.lines());
  return result;
}

const std::map<std::string, std::string>& built_in_measurements() {
  return embedded_measurements;
}

}  // namespace cohort
