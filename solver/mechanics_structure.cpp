#include "solver/mechanics_structure.hpp"

namespace cohort {

Mechanics default_heart_mechanics(bool windkessel) {
  using Kind = Mechanics::Boundary::Kind;
  Mechanics mechanics;
  mechanics.law = "guccione";
  mechanics.tension = "twitch";
  mechanics.cavities = {{"lv", {}}};
  if (!windkessel) mechanics.cavities.push_back({"rv", {}});
  mechanics.boundary = {{"base", "base", Kind::clamp_normal},
                        {"base_ring", "base", Kind::spring},
                        {"epicardium", "epicardium", Kind::spring_normal}};
  return mechanics;
}

std::vector<std::string> boundary_surfaces(const Scene& scene) {
  if (scene.geometry == GeometryKind::heart)
    return {"base", "epicardium", "lv_endocardium", "rv_endocardium"};
  std::vector<std::string> names;
  for (const Shape& shape : scene.shapes) names.push_back(shape.name);
  return names;
}

}  // namespace cohort
