#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/suggest.hpp"
#include "solver/electrophysiology.hpp"

namespace cohort {

namespace {

using Kind = Distribution::Kind;

constexpr std::pair<const char*, Kind> kinds[] = {{"uniform", Kind::uniform},
                                                  {"log_uniform", Kind::log_uniform},
                                                  {"normal", Kind::normal},
                                                  {"choice", Kind::choice}};

std::string usage() {
  return "{uniform: [a, b]}, {log_uniform: [a, b]}, {normal: [mean, sd]} or {choice: [..]}";
}

/// The key that says which distribution it is, or null after a mistake.
Node::Entry* distribution_key(Node& node, const std::string& path, Mistakes& mistakes) {
  Node::Entry* chosen = nullptr;
  for (const auto& [word, kind] : kinds) node.known.insert(word);
  for (Node::Entry& entry : node.entries) {
    if (!node.known.contains(entry.key)) continue;
    if (!chosen)
      chosen = &entry;
    else if (entry.key != chosen->key)
      mistakes.add(entry.place,
                   fmt::format("{} has two distributions, \"{}\" and \"{}\"", path, chosen->key, entry.key));
  }
  node.known.insert("bounds");
  check_keys(node, {}, mistakes);
  const bool unknown = std::any_of(node.entries.begin(), node.entries.end(),
                                   [](const Node::Entry& entry) { return entry.value.read; });
  if (!chosen && !unknown)
    mistakes.add(node.place, fmt::format("{} needs a distribution: {}", path, usage()));
  return chosen;
}

/// True where `value` lies in the admissible range; else adds a mistake.
bool admissible(double value, const Parameter& parameter, const Place& place, Mistakes& mistakes) {
  if (value >= parameter.lower && value <= parameter.upper) return true;
  mistakes.add(place, fmt::format("{} would be sampled at {}; it must lie in {}", parameter.path,
                                  with_unit(value, parameter.unit),
                                  range(parameter.lower, parameter.upper, parameter.unit)));
  return false;
}

/// A pair a < b within the admissible range.
bool read_interval(Node& node, const Parameter& parameter, double& a, double& b, Mistakes& mistakes) {
  const auto pair = read_numbers(node, node.path, parameter.unit, 2, mistakes);
  if (!pair) return false;
  a = (*pair)[0];
  b = (*pair)[1];
  if (!(a < b)) {
    mistakes.add(node.place,
                 fmt::format("{} has the interval [{}, {}]; the first must be less than the second",
                             parameter.path, a, b));
    return false;
  }
  const bool lower = admissible(a, parameter, node.items[0].place, mistakes);
  const bool upper = admissible(b, parameter, node.items[1].place, mistakes);
  return lower && upper;
}

void read_normal(Node& node, Node* bounds, const Parameter& parameter, Distribution& distribution,
                 Mistakes& mistakes) {
  distribution.lower = parameter.lower;
  distribution.upper = parameter.upper;
  if (bounds && !read_interval(*bounds, parameter, distribution.lower, distribution.upper, mistakes)) return;
  const auto pair = read_numbers(node, node.path, parameter.unit, 2, mistakes);
  if (!pair) return;
  distribution.a = (*pair)[0];
  distribution.b = (*pair)[1];
  if (!(distribution.b > 0))
    mistakes.add(node.items[1].place, fmt::format("{} has the standard deviation {}; it must be positive",
                                                  parameter.path, distribution.b));
  if (distribution.a < distribution.lower || distribution.a > distribution.upper)
    mistakes.add(node.items[0].place,
                 fmt::format("{} has the mean {}; it must lie within the bounds {}", parameter.path,
                             with_unit(distribution.a, parameter.unit),
                             range(distribution.lower, distribution.upper, parameter.unit)));
}

void read_choices(Node& node, const Parameter& parameter, Distribution& distribution, Mistakes& mistakes) {
  const auto numbers = read_numbers(node, node.path, parameter.unit, 0, mistakes);
  if (!numbers) return;
  if (numbers->empty())
    mistakes.add(node.place, fmt::format("{} has no values to choose from", parameter.path));
  for (size_t i = 0; i < numbers->size(); ++i)
    admissible((*numbers)[i], parameter, node.items[i].place, mistakes);
  distribution.choices = *numbers;
  if (numbers->empty()) return;
  distribution.lower = distribution.a = *std::min_element(numbers->begin(), numbers->end());
  distribution.upper = distribution.b = *std::max_element(numbers->begin(), numbers->end());
}

void read_distribution(Node& node, const Parameter& parameter, Distribution& distribution,
                       Mistakes& mistakes) {
  if (node.kind != Node::Kind::map) {
    mistakes.add(node.place,
                 fmt::format("{} needs a distribution: {}; {}", parameter.path, usage(), found(node)));
    return;
  }
  Node::Entry* key = distribution_key(node, parameter.path, mistakes);
  if (!key) return;
  distribution.kind = std::find_if(std::begin(kinds), std::end(kinds), [&](const auto& kind) {
                        return key->key == kind.first;
                      })->second;
  Node* bounds = node.find("bounds");
  if (bounds && distribution.kind != Kind::normal)
    mistakes.add(bounds->place,
                 fmt::format("{}: bounds belong to normal; {} has its own", parameter.path, key->key));

  switch (distribution.kind) {
    case Kind::uniform:
    case Kind::log_uniform:
      if (!read_interval(key->value, parameter, distribution.a, distribution.b, mistakes)) return;
      if (distribution.kind == Kind::log_uniform && !(distribution.a > 0))
        mistakes.add(key->value.items[0].place,
                     fmt::format("{} begins at {}; log_uniform needs a positive interval", parameter.path,
                                 distribution.a));
      distribution.lower = distribution.a;
      distribution.upper = distribution.b;
      break;
    case Kind::normal:
      read_normal(key->value, bounds, parameter, distribution, mistakes);
      break;
    case Kind::choice:
      read_choices(key->value, parameter, distribution, mistakes);
      break;
  }
}

std::string no_such_parameter(const std::string& path, const Scene& scene) {
  const ParameterTable& table = scene.parameters;
  if (path.starts_with("electrophysiology."))
    if (const std::string why = unread_parameter(scene, path.substr(path.rfind('.') + 1)); !why.empty())
      return fmt::format("parameter \"{}\": {}", path, why);
  if (table.find(path + ".x") >= 0)
    return fmt::format("parameter \"{}\" is a vector; name a component, \"{}.x\", .y or .z", path, path);
  std::vector<std::string> paths;
  for (const Parameter& parameter : table.all())
    if (!parameter.structural) paths.push_back(parameter.path);
  return fmt::format("parameter \"{}\" does not exist in this scene{}", path, suggestion(path, paths));
}

std::string structural(const std::string& path) {
  return fmt::format(
      "parameter \"{}\" is structural: all members share it, so it cannot be sampled; set it in scene", path);
}

}  // namespace

const Parameter* read_path(const Node::Entry& entry, const Scene& scene, Mistakes& mistakes) {
  const int index = scene.parameters.find(entry.key);
  const bool usable = index >= 0 && !scene.parameters[index].structural;
  if (!usable)
    mistakes.add(entry.place, index < 0 ? no_such_parameter(entry.key, scene) : structural(entry.key));
  return usable ? &scene.parameters[index] : nullptr;
}

void read_sampled(Node& map, const std::vector<std::string>& aside, Campaign& campaign, Mistakes& mistakes) {
  for (Node::Entry& entry : map.entries) {
    const auto holds_it = [&](const std::string& level) { return entry.key.starts_with(level + "."); };
    if (std::any_of(aside.begin(), aside.end(), holds_it)) continue;
    const Parameter* parameter = read_path(entry, campaign.scene, mistakes);
    if (!parameter) continue;
    SampledParameter sampled{entry.key, {}};
    read_distribution(entry.value, *parameter, sampled.distribution, mistakes);
    campaign.parameters.push_back(std::move(sampled));
  }
}

}  // namespace cohort
