#include "ensemble/measurements.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "ensemble/config.hpp"
#include "ensemble/identity.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/study.hpp"

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

/// A number, or infinity where "unknown" stands.
double read_bound(Node& map, const std::string& key, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) {
    mistakes.add(map.place, fmt::format("\"{}\" is missing", key));
    return 0;
  }
  if (node->kind == Node::Kind::scalar && node->text == "unknown") {
    node->read = true;
    return std::numeric_limits<double>::infinity();
  }
  return read_number(*node, key, "", mistakes).value_or(0);
}

std::string read_line(Node& root, const std::string& key, Mistakes& mistakes) {
  Node* node = take(root, key);
  if (node) return read_text(*node, key, mistakes).value_or("");
  mistakes.add(root.place, fmt::format("\"{}\" is missing", key));
  return {};
}

std::vector<std::string> read_lines(Node& root, const std::string& key, Mistakes& mistakes) {
  Node* node = take(root, key);
  if (!node) {
    mistakes.add(root.place, fmt::format("\"{}\" is missing", key));
    return {};
  }
  if (node->kind == Node::Kind::sequence && node->items.empty()) {
    node->read = true;
    return {};
  }
  return read_texts(*node, key, mistakes).value_or(std::vector<std::string>());
}

MeasuredSetting read_setting(Node& map, Mistakes& mistakes) {
  MeasuredSetting setting;
  setting.label = read_line(map, "label", mistakes);
  setting.device_s = read_bound(map, "device_s", mistakes);
  if (Node* set = require_map(map, "set", mistakes)) {
    set->read = true;
    for (const Node::Entry& entry : set->entries) setting.set.emplace_back(entry.key, flow_text(entry.value));
  }
  if (Node* errors = require_map(map, "errors", mistakes)) {
    errors->read = true;
    for (Node::Entry& entry : errors->entries) {
      if (!expect_map(entry.value, entry.key, mistakes)) continue;
      MeasuredError error{};
      error.rms = read_bound(entry.value, "rms", mistakes);
      error.largest = read_bound(entry.value, "largest", mistakes);
      error.bound = read_bound(entry.value, "bound", mistakes);
      error.bound_percent = read_bound(entry.value, "bound_percent", mistakes);
      setting.errors[entry.key] = error;
    }
  }
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

std::map<std::string, double> own_values(const Scene& scene) {
  Scene bare = scene;
  bare.parameters = {};
  if (bare.geometry != GeometryKind::shapes) bare.regions.clear();
  declare_parameters(bare);
  std::map<std::string, double> result;
  for (const Parameter& parameter : scene.parameters.all()) {
    const int place = bare.parameters.find(parameter.path);
    const double usual = place < 0 ? inherited : bare.parameters[place].value;
    if (!std::isnan(parameter.value) && parameter.value != usual) result[parameter.path] = parameter.value;
  }
  return result;
}

double tolerance_factor(int n) {
  constexpr double covers = 1.6449, confidence = 1.2816;  // normal quantiles of 0.95 and 0.9
  const double a = 1 - confidence * confidence / (2 * (n - 1.0));
  const double b = covers * covers - confidence * confidence / n;
  return (covers + std::sqrt(covers * covers - a * b)) / a;
}

std::string measurements_text(const Measurements& m) {
  std::string text = fmt::format(
      "# Measured by `cohort study`; `accuracy:` of a campaign chooses from it. Errors are in a feature's "
      "unit; bounds hold for\n"
      "# 95 % of members like those measured, with a confidence of 90 %, and count what the reference itself "
      "is off.\n"
      "version: {}\nprogram: {}\nstudy: {}\ndevice: {}\nreference: {}\nmembers: {}\n",
      Measurements::version, quoted(m.program), quoted(m.study), quoted(m.device), quoted(m.reference),
      m.members);
  text += "structure:" + list(m.structure) + "varied:" + list(m.varied);
  const auto map = [&](const char* name, const auto& entries, const auto& value) {
    text += fmt::format("{}:{}\n", name, entries.empty() ? " {}" : "");
    for (const auto& entry : entries) text += fmt::format("  {}: {}\n", entry.first, value(entry.second));
  };
  map("values", m.values, [](double value) { return fmt::format("{}", value); });
  map("sampled", m.sampled, [](const std::pair<double, double>& range) {
    return fmt::format("[{:.6g}, {:.6g}]", range.first, range.second);
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
  const auto version = read_bound(root, "version", mistakes);
  if (mistakes.empty() && version != Measurements::version)
    mistakes.add(root.place,
                 fmt::format("measurements of version {}; this program reads version {}: run the study again",
                             version, Measurements::version));
  result.program = read_line(root, "program", mistakes);
  result.study = read_line(root, "study", mistakes);
  result.device = read_line(root, "device", mistakes);
  result.reference = read_line(root, "reference", mistakes);
  result.members = static_cast<int>(read_bound(root, "members", mistakes));
  result.structure = read_lines(root, "structure", mistakes);
  result.varied = read_lines(root, "varied", mistakes);
  if (Node* values = require_map(root, "values", mistakes)) {
    values->read = true;
    for (Node::Entry& entry : values->entries)
      if (const auto value = read_number(entry.value, entry.key, "", mistakes))
        result.values[entry.key] = *value;
  }
  if (Node* sampled = require_map(root, "sampled", mistakes)) {
    sampled->read = true;
    for (Node::Entry& entry : sampled->entries)
      if (const auto range = read_numbers(entry.value, entry.key, "", 2, mistakes))
        result.sampled[entry.key] = {(*range)[0], (*range)[1]};
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
        result.settings.push_back(read_setting(setting, mistakes));
  } else {
    mistakes.add(root.place, "\"settings\" is a list of what was measured");
  }
  if (!mistakes.empty()) throw ConfigError(mistakes.lines());
  return result;
}

const std::map<std::string, std::string>& built_in_measurements() {
  return embedded_measurements;
}

}  // namespace cohort
