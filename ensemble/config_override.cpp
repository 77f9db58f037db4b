#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <string_view>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"

namespace cohort {

namespace {

constexpr std::array sections = {"scene",    "outputs", "parameters", "campaign",
                                 "accuracy", "store",   "stability"};

/// Keys from the root of the file down to what `path` names.
std::vector<std::string> keys_of(const std::string& path) {
  std::vector<std::string> keys;
  size_t begin = 0;
  for (size_t dot = path.find('.'); dot != std::string::npos; dot = path.find('.', begin)) {
    keys.push_back(path.substr(begin, dot - begin));
    begin = dot + 1;
    // Below `parameters` the key is the path of a parameter, dots and all.
    if (keys.size() == 1 && keys[0] == "parameters") break;
  }
  keys.push_back(path.substr(begin));
  if (std::find(sections.begin(), sections.end(), keys[0]) == sections.end())
    keys.insert(keys.begin(), "scene");
  return keys;
}

/// [x, y, z] as {x:, y:, z:}, so that one component can be replaced.
void name_components(Node& node) {
  constexpr std::array components = {"x", "y", "z"};
  node.kind = Node::Kind::map;
  for (size_t axis = 0; axis < components.size(); ++axis)
    node.entries.push_back({components[axis], node.items[axis].place, node.items[axis]});
  node.items.clear();
}

/// The value below `node` that the parameter `path` is read from, or null.
Node* leaf(Node* node, const std::string& path) {
  constexpr std::string_view components = "xyz";
  std::istringstream keys(path);
  for (std::string key; node && std::getline(keys, key, '.');) {
    const size_t axis = components.find(key);
    if (node->kind == Node::Kind::sequence)
      node = axis < node->items.size() ? &node->items[axis] : nullptr;
    else
      node = node->find(key);
  }
  return node;
}

}  // namespace

void apply_override(Node& root, const std::string& assignment, int number, Mistakes& mistakes) {
  const Place place{"--set", number, 0};
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    mistakes.add(place, fmt::format("\"{}\" is not key=value", assignment));
    return;
  }
  const std::string path = assignment.substr(0, equals);
  Mistakes syntax;
  Node value = parse_override(assignment.substr(equals + 1), number, syntax);
  if (!syntax.empty()) {
    mistakes.add(place, fmt::format("the value of {} is {}", path, "not YAML"));
    return;
  }
  value.place = place;

  Node* node = &root;
  for (const std::string& key : keys_of(path)) {
    if (node->kind == Node::Kind::sequence && node->items.size() == 3) name_components(*node);
    if (node->kind == Node::Kind::null) node->kind = Node::Kind::map;
    if (node->kind != Node::Kind::map) {
      mistakes.add(
          place, fmt::format("{} cannot be set: \"{}\" would stand below a value that is no map", path, key));
      return;
    }
    Node* child = node->find(key);
    if (!child) {
      Node missing;
      missing.place = place;
      node->entries.push_back({key, place, std::move(missing)});
      child = &node->entries.back().value;
    }
    node = child;
  }
  *node = std::move(value);
}

void refuse_set(Node* scene, Node* outputs, const std::string& path, const std::string& why,
                Mistakes& mistakes) {
  const std::string prefix = "outputs.";
  const bool output = path.starts_with(prefix);
  const Node* node = leaf(output ? outputs : scene, output ? path.substr(prefix.size()) : path);
  if (node && node->place.file == "--set") mistakes.add(node->place, path + " " + why);
}

}  // namespace cohort
