#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <stdexcept>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/suggest.hpp"
#include "solver/cell_models.hpp"
#include "solver/electrophysiology.hpp"
#include "solver/geometry.hpp"
#include "solver/heterogeneity.hpp"

// The keys of `electrophysiology` that are structure: cell models, also of regions, and what varies through
// walls.
namespace cohort {

namespace {

bool holds(const std::vector<std::string>& list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

/// The scene with the regions that its geometry has; without any where the geometry has mistakes.
Scene with_regions(const Scene& scene) {
  Scene result = scene;
  try {
    declare_geometry(result);
  } catch (const std::invalid_argument&) {
    result.regions.clear();
  }
  return result;
}

std::vector<std::string> parameter_names(const CellModel& model) {
  std::vector<std::string> names;
  for (const Parameter& parameter : model.parameters) names.push_back(parameter.path);
  return names;
}

/// Cell models of single regions: electrophysiology.regions.<name>.cell_model.
void read_region_models(Node& regions, const Scene& with_regions, Scene& scene, Mistakes& mistakes) {
  const std::vector<std::string> models = cell_models();
  for (const Region& region : with_regions.regions) {
    Node* own = region.excitable ? regions.find(region.name) : nullptr;
    if (!own || own->kind != Node::Kind::map) continue;  // what else stands there is told with the numbers
    Node* model = take(*own, "cell_model");
    if (!model) continue;
    if (const auto index = read_choice(*model, model->path, models, mistakes))
      scene.region_cell_models[region.name] = models[*index];
    else
      own->read = true;  // its numbers depend on what is wrong
  }
}

/// Tells parameters of a cell model that their region does not have, and models that no region has.
void refuse_other_models(Node& electrophysiology, Node* regions, const Scene& with_regions,
                         Mistakes& mistakes) {
  const CellModels used(with_regions);
  std::vector<std::string> used_names;
  for (const CellModel& model : used.all()) used_names.push_back(model.name);
  std::vector<CellModel> others;
  for (const std::string& name : cell_models()) {
    if (holds(used_names, name)) continue;
    others.push_back(read_cell_model(name));
    if (Node* section = electrophysiology.find(name)) {
      section->read = true;
      electrophysiology.known.insert(name);
      mistakes.add(section->place,
                   fmt::format("no region has the cell model {}; its parameters would have no effect", name));
    }
  }
  others.insert(others.end(), used.all().begin(), used.all().end());
  for (size_t r = 0; regions && r < with_regions.regions.size(); ++r) {
    Node* own = regions->find(with_regions.regions[r].name);
    if (!own || own->read || own->kind != Node::Kind::map || used.of_region()[r] < 0) continue;
    const CellModel& model = used.all()[static_cast<size_t>(used.of_region()[r])];
    for (Node::Entry& entry : own->entries) {
      if (holds(parameter_names(model), entry.key)) continue;
      const auto other = std::find_if(others.begin(), others.end(), [&](const CellModel& candidate) {
        return holds(parameter_names(candidate), entry.key);
      });
      if (other == others.end()) continue;
      entry.value.read = true;
      mistakes.add(entry.place, fmt::format("{} is a parameter of {}; the cell model of {} is {}", entry.key,
                                            other->name, own->path, model.name));
    }
  }
}

void read_heterogeneity(Node& node, const Scene& with_regions, Scene& scene, Mistakes& mistakes) {
  const size_t before = mistakes.size();
  std::vector<std::string> walls;
  for (const Region& region : with_regions.regions)
    if (has_wall(with_regions, region)) walls.push_back(region.name);
  if (walls.empty()) {
    node.read = true;
    mistakes.add(node.place,
                 fmt::format("{}: no region of this geometry has a wall to vary through", node.path));
    return;
  }
  Heterogeneity& chosen = scene.heterogeneity;
  if (Node* regions = take(node, "regions")) {
    const auto names = read_texts(*regions, regions->path, mistakes);
    for (const std::string& name : names.value_or(std::vector<std::string>{})) {
      if (!holds(walls, name))
        mistakes.add(regions->place, fmt::format("{}: no region with a wall is called \"{}\"{}",
                                                 regions->path, name, suggestion(name, walls)));
      else if (holds(chosen.regions, name))
        mistakes.add(regions->place, fmt::format("{} names \"{}\" twice", regions->path, name));
      else
        chosen.regions.push_back(name);
    }
  }
  Scene asked = with_regions;
  asked.heterogeneity = {{"any"}, chosen.regions};
  const std::vector<bool> taking_part = heterogeneous_regions(asked);
  const CellModels models(with_regions);
  std::vector<std::string> known;
  for (size_t r = 0; r < taking_part.size(); ++r) {
    if (!taking_part[r]) continue;
    for (const std::string& name : parameter_names(models.all()[static_cast<size_t>(models.of_region()[r])]))
      if (!holds(known, name)) known.push_back(name);
  }
  const std::vector<std::string> layers = layer_bounds();
  for (Node::Entry& entry : node.entries) {
    if (entry.key == "regions" || holds(layers, entry.key)) continue;
    if (holds(known, entry.key)) {
      chosen.parameters.push_back(entry.key);
      continue;
    }
    entry.value.read = true;
    std::vector<std::string> candidates = known;
    candidates.insert(candidates.end(), layers.begin(), layers.end());
    candidates.emplace_back("regions");
    mistakes.add(entry.place,
                 fmt::format("unknown key \"{}\" in {}, which takes parameters of the cell model{}",
                             entry.key, node.path, suggestion(entry.key, candidates)));
  }
  if (chosen.parameters.empty()) {
    if (mistakes.size() == before)
      mistakes.add(node.place, fmt::format("{} names no parameter of the cell model that varies", node.path));
    node.read = true;
    return;
  }
  // The order in the file has no meaning.
  std::sort(chosen.parameters.begin(), chosen.parameters.end());
  std::sort(chosen.regions.begin(), chosen.regions.end());
}

/// Tells numbers that the chosen equation does not read.
void refuse_unread(Node& map, const Scene& scene, Mistakes& mistakes) {
  for (Node::Entry& entry : map.entries) {
    if (const std::string why = unread_parameter(scene, entry.key); !why.empty()) {
      entry.value.read = true;
      mistakes.add(entry.place, map.path + ": " + why);
    }
  }
}

}  // namespace

void read_electrophysiology(Node& electrophysiology, Scene& scene, Mistakes& mistakes) {
  if (Node* method = take(electrophysiology, "activation"))
    scene.activation_method =
        read_word<ActivationMethod>(*method,
                                    {{"automatic", ActivationMethod::automatic},
                                     {"monodomain", ActivationMethod::monodomain},
                                     {"bidomain", ActivationMethod::bidomain},
                                     {"reaction_eikonal", ActivationMethod::reaction_eikonal},
                                     {"eikonal", ActivationMethod::eikonal}},
                                    scene.activation_method, mistakes);
  if (Node* splitting = take(electrophysiology, "splitting"))
    scene.splitting =
        read_word<Splitting>(*splitting, {{"strang", Splitting::strang}, {"godunov", Splitting::godunov}},
                             scene.splitting, mistakes);
  if (Node* system = take_map(electrophysiology, "conduction_system", mistakes))
    read_conduction_system(*system, scene, mistakes);
  scene.stretch_activated = take_map(electrophysiology, "stretch_activated", mistakes) != nullptr;
  const size_t before = mistakes.size();
  if (Node* model = take(electrophysiology, "cell_model")) {
    const std::vector<std::string> models = cell_models();
    if (const auto index = read_choice(*model, model->path, models, mistakes))
      scene.cell_model = models[*index];
  }
  Scene regional = with_regions(scene);
  Node* regions = take_map(electrophysiology, "regions", mistakes);
  refuse_unread(electrophysiology, scene, mistakes);
  if (regions)
    for (Node::Entry& region : regions->entries)
      if (region.value.kind == Node::Kind::map) refuse_unread(region.value, scene, mistakes);
  if (regions) read_region_models(*regions, regional, scene, mistakes);
  regional.region_cell_models = scene.region_cell_models;
  const bool sound = mistakes.size() == before && !regional.regions.empty();
  if (sound) refuse_other_models(electrophysiology, regions, regional, mistakes);
  Node* heterogeneity = take_map(electrophysiology, "heterogeneity", mistakes);
  if (heterogeneity && sound)
    read_heterogeneity(*heterogeneity, regional, scene, mistakes);
  else if (heterogeneity)
    heterogeneity->read = true;  // it depends on what is wrong
}

}  // namespace cohort
