#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/suggest.hpp"
#include "solver/conduction_system.hpp"

// electrophysiology.conduction_system: its structure; numbers are left for read_parameters.
namespace cohort {

namespace {

/// The early sites: each of the normal ones unless it is off, and those of other names with a surface.
void read_early_sites(Node& sites, ConductionSystem& system, Mistakes& mistakes) {
  using Surface = ConductionSystem::Surface;
  std::vector<std::string> normal_names;
  for (const ConductionSystem::EarlySite& site : system.early_sites) normal_names.push_back(site.name);
  for (Node::Entry& entry : sites.entries) {
    Node& node = entry.value;
    sites.known.insert(entry.key);
    const auto site =
        std::find_if(system.early_sites.begin(), system.early_sites.end(),
                     [&](const ConductionSystem::EarlySite& normal) { return normal.name == entry.key; });
    const bool normal = site != system.early_sites.end();
    if (normal && node.kind == Node::Kind::scalar && node.text == "off") {
      node.read = true;
      system.early_sites.erase(site);
    } else if (!check_name(entry, "an early site", mistakes)) {
      node.read = true;
    } else if (node.kind != Node::Kind::map) {
      node.read = true;
      mistakes.add(entry.place, normal ? fmt::format("{} takes its numbers, or \"off\"", node.path)
                                       : fmt::format("{} is no site of the normal heart{}", node.path,
                                                     suggestion(entry.key, normal_names)));
    } else if (!normal) {
      ConductionSystem::EarlySite added{entry.key, Surface::lv};
      if (Node* surface = take(node, "surface"))
        added.surface = read_word<Surface>(
            *surface,
            {{"lv", Surface::lv}, {"rv_septum", Surface::rv_septum}, {"rv_free_wall", Surface::rv_free_wall}},
            added.surface, mistakes);
      else
        mistakes.add(entry.place,
                     fmt::format("\"surface\" is missing in {}: lv, rv_septum or rv_free_wall", node.path));
      system.early_sites.push_back(std::move(added));
    }
  }
}

}  // namespace

void read_conduction_system(Node& node, Scene& scene, Mistakes& mistakes) {
  using Kind = ConductionSystem::Kind;
  if (scene.geometry != GeometryKind::heart && scene.geometry != GeometryKind::labels) {
    mistakes.add(node.place, fmt::format("{}: only the heart has one", node.path));
    node.read = true;
    return;
  }
  ConductionSystem& system = scene.conduction_system.emplace();
  if (Node* kind = take(node, "atrioventricular"))
    system.kind =
        read_word<Kind>(*kind, {{"delay", Kind::delay}, {"path", Kind::path}}, system.kind, mistakes);
  if (system.kind == Kind::delay) system.early_sites = default_early_sites();
  if (Node* sites = take_map(node, "early_sites", mistakes)) {
    if (system.kind == Kind::path) {
      mistakes.add(sites->place, "early sites follow the atrioventricular delay; the path has none");
      sites->read = true;
    } else {
      read_early_sites(*sites, system, mistakes);
    }
  }
}

}  // namespace cohort
