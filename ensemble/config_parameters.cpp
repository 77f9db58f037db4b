#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/suggest.hpp"

// Numbers below `scene` and `outputs`: each leaf is the parameter that its keys spell, joined by dots.
namespace cohort {

namespace {

constexpr const char* components[] = {"x", "y", "z"};

std::string below(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

/// Keys that parameters have right below `path`.
std::vector<std::string> children(const ParameterTable& table, const std::string& path) {
  std::vector<std::string> keys;
  const std::string prefix = path.empty() ? "" : path + ".";
  for (const Parameter& parameter : table.all()) {
    if (!parameter.path.starts_with(prefix)) continue;
    const std::string rest = parameter.path.substr(prefix.size());
    const std::string key = rest.substr(0, rest.find('.'));
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(key);
  }
  return keys;
}

bool is_vector(const ParameterTable& table, const std::string& path) {
  return std::all_of(std::begin(components), std::end(components),
                     [&](const char* axis) { return table.find(below(path, axis)) >= 0; });
}

void set_number(Node& node, const std::string& path, ParameterTable& table, Mistakes& mistakes) {
  Parameter& parameter = table[table.index(path)];
  const auto value = read_number(node, path, parameter.unit, mistakes);
  if (!value) return;
  if (*value < parameter.lower || *value > parameter.upper) {
    mistakes.add(node.place,
                 fmt::format("{} is {}; it must lie in {}", path, with_unit(*value, parameter.unit),
                             range(parameter.lower, parameter.upper, parameter.unit)));
    return;
  }
  parameter.value = *value;
}

void set_vector(Node& node, const std::string& path, ParameterTable& table, Mistakes& mistakes) {
  node.read = true;
  if (node.kind != Node::Kind::sequence || node.items.size() != std::size(components)) {
    const std::string given = node.kind == Node::Kind::sequence
                                  ? fmt::format("found a list of {}", node.items.size())
                                  : found(node);
    mistakes.add(node.place, fmt::format("{} must be three numbers [x, y, z], {}", path, given));
    return;
  }
  for (size_t axis = 0; axis < std::size(components); ++axis)
    set_number(node.items[axis], below(path, components[axis]), table, mistakes);
}

/// ", which is geometry.heart.lv_radius_mm" where the key is a parameter of another level.
std::string elsewhere(const std::string& key, const ParameterTable& table) {
  for (const Parameter& parameter : table.all()) {
    const bool vector = parameter.path.ends_with("." + key + ".x");
    if (parameter.path.ends_with("." + key) || vector) {
      const std::string path = vector ? parameter.path.substr(0, parameter.path.size() - 2) : parameter.path;
      return fmt::format("; did you mean \"{}\"?", path);
    }
  }
  return {};
}

}  // namespace

void read_parameters(Node& map, ParameterTable& table, Mistakes& mistakes) {
  std::vector<std::string> known = children(table, map.path);
  for (const std::string& key : map.known)
    if (std::find(known.begin(), known.end(), key) == known.end()) known.push_back(key);
  std::sort(known.begin(), known.end());

  for (Node::Entry& entry : map.entries) {
    Node& node = entry.value;
    if (node.read) continue;
    const std::string path = below(map.path, entry.key);
    if (table.find(path) >= 0) {
      set_number(node, path, table, mistakes);
    } else if (is_vector(table, path) && node.kind != Node::Kind::map) {
      set_vector(node, path, table, mistakes);
    } else if (std::find(known.begin(), known.end(), entry.key) != known.end()) {
      if (expect_map(node, path, mistakes)) read_parameters(node, table, mistakes);
    } else {
      const std::string near = suggestion(entry.key, known);
      const std::string far = near.starts_with("; did") ? "" : elsewhere(entry.key, table);
      mistakes.add(entry.place,
                   fmt::format("unknown key \"{}\" in {}{}", entry.key, map.name, far.empty() ? near : far));
    }
  }
}

}  // namespace cohort
