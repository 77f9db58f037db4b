#include "ensemble/work_precision_design.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <filesystem>

#include "ensemble/config.hpp"
#include "ensemble/identity.hpp"
#include "ensemble/measure_accuracy.hpp"
#include "ensemble/read_values.hpp"
#include "solver/mechanics.hpp"

namespace cohort {

namespace {

constexpr std::int64_t most_repeats = 1000;

/// What a value of `path` is called where it stands in a label: "2 mm", "0.01 ms", "double", "step_factor 2".
std::string called(const std::string& path, const std::string& value) {
  const std::string key = path.substr(path.rfind('.') + 1);
  const bool number = !value.empty() && value.find_first_not_of("+-.0123456789eE") == std::string::npos;
  if (!number) return value;
  std::string text;
  // Lengths and steps that are not those of the scene's grid and time are told by their section.
  if (const size_t dot = path.rfind('.'); dot != std::string::npos)
    if (const std::string section = path.substr(0, dot); section != "grid" && section != "time")
      text = section.substr(section.rfind('.') + 1) + " ";
  for (const char* unit : {"mm", "ms"})
    if (key.ends_with(std::string("_") + unit)) return text + value + " " + unit;
  return text + key + " " + value;
}

/// The alternatives of every key of `group`, multiplied out; the first key varies slowest.
std::vector<Setting> product(const Node& group, const std::string& name, Mistakes& mistakes) {
  std::vector<Setting> all = {Setting{name, {}}};
  for (const Node::Entry& entry : group.entries) {
    if (entry.key == "label") continue;
    std::vector<Node> alternatives =
        entry.value.kind == Node::Kind::sequence ? entry.value.items : std::vector<Node>{entry.value};
    if (alternatives.empty()) {
      mistakes.add(entry.place, entry.key + " is an empty list: name its alternatives, or leave it out");
      continue;
    }
    std::vector<Setting> next;
    for (const Setting& before : all)
      for (const Node& value : alternatives) {
        Setting setting = before;
        setting.values.emplace_back(entry.key, flow_text(value));
        setting.places.push_back(entry.place);
        if (alternatives.size() > 1 || name.empty())
          setting.label +=
              fmt::format("{}{}", setting.label.empty() ? "" : " ", called(entry.key, flow_text(value)));
        next.push_back(std::move(setting));
      }
    all = std::move(next);
  }
  return all;
}

std::vector<Setting> read_settings(Node& list, Mistakes& mistakes) {
  std::vector<Setting> result;
  list.read = true;
  if (list.kind != Node::Kind::sequence || list.items.empty()) {
    mistakes.add(list.place, "settings is a list of maps {key: [values], ...}, " + found(list));
    return result;
  }
  for (Node& group : list.items) {
    if (group.kind != Node::Kind::map || group.entries.empty()) {
      mistakes.add(group.place, "a group of settings is a map {key: [values], ...}, " + found(group));
      continue;
    }
    std::string label;
    if (Node* node = group.find("label")) label = read_text(*node, "label", mistakes).value_or("");
    for (Setting& setting : product(group, label, mistakes)) result.push_back(std::move(setting));
  }
  return result;
}

void read_reference(Node& node, WorkPrecisionDesign& design, Mistakes& mistakes) {
  node.read = true;
  if (node.kind != Node::Kind::map || node.entries.empty()) {
    mistakes.add(node.place,
                 "reference is what a finer run sets, {key: value, ...}, or {values: {feature: value, ...}}");
    return;
  }
  if (Node* values = node.find("values")) {
    if (values->kind != Node::Kind::map || values->entries.empty() || node.entries.size() > 1)
      return mistakes.add(values->place, "reference.values is a map {feature: value, ...} and stands alone");
    for (Node::Entry& entry : values->entries)
      if (const auto value = read_number(entry.value, "reference.values." + entry.key, "", mistakes))
        design.known[entry.key] = *value;
    return;
  }
  design.reference = Setting{"reference", {}};
  for (const Node::Entry& entry : node.entries) {
    design.reference->values.emplace_back(entry.key, flow_text(entry.value));
    design.reference->places.push_back(entry.place);
  }
}

}  // namespace

std::vector<std::string> Setting::overrides() const {
  std::vector<std::string> result;
  for (const auto& [path, value] : values) result.push_back(path + "=" + value);
  return result;
}

Study in_scene(const Study& study, const Setting& scene) {
  Study result = study;
  // What the command line sets stands behind, and wins.
  const std::vector<std::string> own = scene.overrides();
  result.overrides.insert(result.overrides.begin(), own.begin(), own.end());
  return result;
}

bool is_step(const std::string& path) {
  return path.ends_with("dx_mm") || path.ends_with("dt_ms") || path.ends_with("step_factor");
}

ResolvedSetting resolved(const Campaign& campaign) {
  const ParameterTable& table = campaign.scene.parameters;
  std::vector<double> values = table.values();
  table.resolve(values);
  ResolvedSetting result;
  result.precision = campaign.scene.precision;
  for (std::size_t i = 0; i < values.size(); ++i) result.values[table.all()[i].path] = values[i];
  if (campaign.scene.mechanics) result.values["mechanics.dx_mm"] = solid_dx_mm(campaign.scene);
  Campaign rest = campaign;
  rest.scene.parameters = {};
  rest.scene.precision = Precision::single_;
  result.rest = canonical_text(rest);
  return result;
}

WorkPrecisionDesign read_work_precision(Study& study) {
  Mistakes mistakes;
  WorkPrecisionDesign design;
  Node& root = study.root;
  if (Node* list = take(root, "settings"))
    design.settings = read_settings(*list, mistakes);
  else
    mistakes.add(root.place, "\"settings\" is missing: what is compared");
  design.scenes = {Setting{}};
  if (Node* node = take_map(root, "for_each", mistakes)) {
    node->read = true;
    design.scenes = product(*node, "", mistakes);
  }
  if (Node* node = take(root, "reference"))
    read_reference(*node, design, mistakes);
  else
    mistakes.add(root.place, "\"reference\" is missing: what errors are measured against");
  if (Node* node = take(root, "measures")) {
    const std::size_t before = mistakes.size();
    design.measures = read_texts(*node, "measures", mistakes).value_or(std::vector<std::string>());
    if (design.measures.empty() && mistakes.size() == before)
      mistakes.add(node->place, "measures is an empty list: nothing would be compared");
  } else {
    mistakes.add(root.place, "\"measures\" is missing: features, or norms of series (ecg, pressure, volume)");
  }
  if (Node* node = take(root, "repeats")) {
    const std::int64_t repeats = read_whole(*node, "repeats", 1, mistakes).value_or(1);
    if (repeats > most_repeats)
      mistakes.add(node->place, fmt::format("repeats is {}; at most {}", repeats, most_repeats));
    else
      design.repeats = static_cast<int>(repeats);
  }
  if (Node* node = take(root, "measurements"))
    if (const auto name = read_text(*node, "measurements", mistakes))
      design.measurements =
          (std::filesystem::path(study.file).parent_path() / *name).lexically_normal().string();
  check_keys(root, {}, mistakes);
  if (!design.measurements.empty() && (!design.reference || design.scenes.size() > 1))
    mistakes.add(root.place, "measurements are of one scene against a reference that is run");
  if (mistakes.empty()) check_design(study, design, mistakes);
  if (!mistakes.empty()) throw ConfigError(mistakes.lines());
  if (!design.measurements.empty()) check_measurable(study, design);
  return design;
}

}  // namespace cohort
