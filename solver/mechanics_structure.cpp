#include "solver/mechanics_structure.hpp"

#include <algorithm>
#include <map>

namespace cohort {

namespace {

bool holds(const Mechanics& mechanics, const std::string& cavity) {
  return std::any_of(mechanics.cavities.begin(), mechanics.cavities.end(),
                     [&](const Mechanics::Cavity& c) { return c.name == cavity; });
}

}  // namespace

DeformingWalls deforming_walls(const Mechanics& mechanics) {
  return {mechanics.cavities.empty() || holds(mechanics, "lv") || holds(mechanics, "rv"),
          holds(mechanics, "la"), holds(mechanics, "ra")};
}

bool deforms(const Scene& scene, const std::string& region) {
  if (scene.geometry != GeometryKind::heart) return true;
  const DeformingWalls walls = deforming_walls(*scene.mechanics);
  if (region == "lv" || region == "rv") return walls.ventricles;
  if (region == "la") return walls.la;
  if (region == "ra") return walls.ra;
  return region == "bachmann" && walls.la && walls.ra;
}

std::vector<Mechanics::Boundary> default_heart_boundary(const Mechanics& mechanics) {
  using Kind = Mechanics::Boundary::Kind;
  const DeformingWalls walls = deforming_walls(mechanics);
  std::vector<Mechanics::Boundary> boundary;
  if (walls.ventricles)
    boundary = {{"base", "base", Kind::clamp_normal},
                {"base_ring", "base", Kind::spring},
                {"epicardium", "epicardium", Kind::spring_normal}};
  if (walls.atria())
    boundary.insert(boundary.end(), {{"atrial_base", "atrial_base", Kind::clamp_normal},
                                     {"atrial_ring", "atrial_base", Kind::spring},
                                     {"atrial_epicardium", "atrial_epicardium", Kind::spring_normal},
                                     {"great_vessels", "great_vessels", Kind::spring_normal}});
  return boundary;
}

Mechanics default_heart_mechanics(bool windkessel) {
  Mechanics mechanics;
  mechanics.law = "guccione";
  mechanics.tension = "twitch";
  mechanics.cavities = {{"lv", {}}};
  if (!windkessel) mechanics.cavities.push_back({"rv", {}});
  mechanics.boundary = default_heart_boundary(mechanics);
  return mechanics;
}

std::optional<double> atrial_default(const Scene& scene, const std::string& region, const std::string& name) {
  if (scene.geometry == GeometryKind::shapes || scene.geometry == GeometryKind::box ||
      !deforming_walls(*scene.mechanics).atria())
    return {};
  if (region != "la" && region != "ra" && region != "bachmann") return {};
  const bool right = region == "ra";
  const std::map<std::string, double> twitch = {{"peak_kPa", right ? 50 : 80},
                                                {"rise_ms", right ? 60 : 70},
                                                {"decay_ms", right ? 40 : 50},
                                                {"duration_ms", right ? 210 : 230}};
  const std::map<std::string, double> guccione = {{"C_kPa", right ? 4 : 8}};
  for (const auto& [material, numbers] : {std::pair("twitch", twitch), std::pair("guccione", guccione)})
    if (scene.mechanics->law == material || scene.mechanics->tension == material)
      if (const auto it = numbers.find(name); it != numbers.end()) return it->second;
  return {};
}

std::vector<std::string> boundary_surfaces(const Scene& scene) {
  std::vector<std::string> names;
  if (scene.geometry == GeometryKind::heart || scene.geometry == GeometryKind::labels) {
    const DeformingWalls walls =
        scene.mechanics ? deforming_walls(*scene.mechanics) : DeformingWalls{true, false, false};
    if (walls.ventricles) names = {"base", "epicardium", "lv_endocardium", "rv_endocardium"};
    if (walls.atria()) names.insert(names.end(), {"atrial_base", "atrial_epicardium", "great_vessels"});
    if (walls.la) names.emplace_back("la_endocardium");
    if (walls.ra) names.emplace_back("ra_endocardium");
    return names;
  }
  for (const Shape& shape : scene.shapes) names.push_back(shape.name);
  return names;
}

}  // namespace cohort
