#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"

// The keys of `outputs` that are structure.
namespace cohort {

namespace {

/// Names of places: NAME_mm: [x, y, z]. what: "a probe", "a point".
std::vector<std::string> read_places(Node& places, const std::string& what, Mistakes& mistakes) {
  const std::string unit = "_mm";
  std::vector<std::string> names;
  for (Node::Entry& entry : places.entries) {
    places.known.insert(entry.key);
    if (!check_name(entry, what, mistakes)) {
      entry.value.read = true;
    } else if (!entry.key.ends_with(unit) || entry.key == unit) {
      entry.value.read = true;
      mistakes.add(entry.place, fmt::format("{}'s key is its name and the unit of its place; write \"{}_mm\"",
                                            what, entry.key));
    } else {
      names.push_back(entry.key.substr(0, entry.key.size() - unit.size()));
    }
  }
  return names;
}

void read_ecg(Node& ecg, Scene& scene, Mistakes& mistakes) {
  scene.ecg.emplace();
  if (Node* leads = take(ecg, "leads")) {
    const auto count = read_whole(*leads, leads->path, 1, mistakes);
    if (count && *count != 12)
      mistakes.add(leads->place, fmt::format("outputs.ecg.leads is {}; there are 12 leads or none", *count));
  }
  if (Node* method = take(ecg, "method"))
    scene.ecg->method = read_word<EcgRequest::Method>(
        *method, {{"lead_field", EcgRequest::Method::lead_field}, {"forward", EcgRequest::Method::forward}},
        scene.ecg->method, mistakes);
}

void read_activation(Node& activation, Scene& scene, Mistakes& mistakes) {
  scene.activation.emplace();
  if (Node* beats = take(activation, "beats"))
    scene.activation->beats = read_bool(*beats, beats->path, mistakes).value_or(false);
  if (Node* probes = take_map(activation, "probes", mistakes))
    scene.activation->probes = read_places(*probes, "a probe", mistakes);
}

void read_displacement(Node& displacement, Scene& scene, Mistakes& mistakes) {
  scene.displacement.emplace();
  Node* points = take_map(displacement, "points", mistakes);
  if (!displacement.find("points") || (points && points->entries.empty()))
    mistakes.add(displacement.place,
                 "outputs.displacement names no point; write points: {NAME_mm: [x, y, z]}");
  else if (points)
    scene.displacement->points = read_places(*points, "a point", mistakes);
}

}  // namespace

void read_outputs(Node& outputs, Scene& scene, Mistakes& mistakes) {
  if (outputs.find("flow")) {  // not suggested to who mistypes another key
    if (Node* node = take(outputs, "flow")) {
      node->read = true;
      mistakes.add(node->place, "outputs.flow is known but not built yet");
    }
  }
  bool any = false;
  for (const char* key : {"ecg", "activation", "pv", "displacement"}) any = any || outputs.find(key);
  if (Node* ecg = take_map(outputs, "ecg", mistakes)) read_ecg(*ecg, scene, mistakes);
  if (Node* activation = take_map(outputs, "activation", mistakes))
    read_activation(*activation, scene, mistakes);
  if (take_map(outputs, "pv", mistakes)) scene.pv.emplace();
  if (Node* displacement = take_map(outputs, "displacement", mistakes))
    read_displacement(*displacement, scene, mistakes);
  if (any) return;
  check_keys(outputs, {}, mistakes);
  if (std::none_of(outputs.entries.begin(), outputs.entries.end(),
                   [](const Node::Entry& entry) { return entry.value.read; }))
    mistakes.add(outputs.place, "outputs is empty; ask for ecg, activation, pv or displacement");
}

}  // namespace cohort
