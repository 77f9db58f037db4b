#include "solver/solid_voids.hpp"

#include <algorithm>
#include <stdexcept>

#include "solver/mechanics.hpp"
#include "solver/mechanics_structure.hpp"

namespace cohort {

namespace {

std::vector<std::string> heart_voids(const Scene& scene) {
  std::vector<std::string> names = {"lv", "rv", "la", "ra", "epicardium", "base"};
  if (deforming_walls(*scene.mechanics).atria())
    names.insert(names.end(), {"atrial_epicardium", "atrial_base", "great_vessels"});
  return names;
}
const std::vector<std::string> box_voids = {"x_lower", "x_upper", "y_lower", "y_upper", "z_lower", "z_upper"};

int index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto it = std::find(names.begin(), names.end(), name);
  return it == names.end() ? -1 : static_cast<int>(it - names.begin());
}

const Shape* find(const Scene& scene, const std::string& name) {
  const auto it =
      std::find_if(scene.shapes.begin(), scene.shapes.end(), [&](const Shape& s) { return s.name == name; });
  return it == scene.shapes.end() ? nullptr : &*it;
}

/// On which side of `shape` the inside of `of` lies: 1 inside it, -1 outside it, 0 where `of` is not made of
/// it.
int side(const Scene& scene, const std::string& shape, const std::string& of) {
  if (shape == of) return 1;
  const Shape* whole = find(scene, of);
  if (!whole) return 0;
  for (size_t i = 0; i < whole->operands.size(); ++i) {
    const int inner = side(scene, shape, whole->operands[i]);
    if (inner != 0) return whole->kind == Shape::Kind::subtract && i > 0 ? -inner : inner;
  }
  return 0;
}

int side_of_tissue(const Scene& scene, const std::string& shape) {
  for (const Region& region : scene.regions)
    if (const int found = side(scene, shape, region.shape)) return found;
  return 0;
}

/// Shapes whose void is asked for, cavities first.
std::vector<std::string> shape_voids(const Scene& scene) {
  std::vector<std::string> names;
  for (const Mechanics::Cavity& cavity : scene.mechanics->cavities) names.push_back(cavity.shape);
  for (const Mechanics::Boundary& boundary : scene.mechanics->boundary)
    if (index_of(names, boundary.surface) < 0) names.push_back(boundary.surface);
  return names;
}

}  // namespace

std::vector<std::string> solid_voids(const Scene& scene) {
  switch (scene.geometry) {
    case GeometryKind::heart:
    case GeometryKind::labels:
      return heart_voids(scene);
    case GeometryKind::box:
      return box_voids;
    case GeometryKind::shapes:
      for (const Mechanics::Cavity& cavity : scene.mechanics->cavities)
        if (!find(scene, cavity.shape))
          throw std::invalid_argument("mechanics.cavities." + cavity.name + ": no shape \"" + cavity.shape +
                                      "\"");
      for (const Mechanics::Boundary& boundary : scene.mechanics->boundary)
        if (side_of_tissue(scene, boundary.surface) == 0)
          throw std::invalid_argument("mechanics.boundary." + boundary.name + ": the shape \"" +
                                      boundary.surface + "\" does not bound the tissue");
      return shape_voids(scene);
    case GeometryKind::none:
      break;
  }
  throw std::invalid_argument("there are no mechanics of this geometry yet");
}

int void_of_surface(const Scene& scene, const std::string& surface) {
  const std::vector<std::string> voids = solid_voids(scene);
  const std::string endocardium = "_endocardium";
  if (scene.geometry != GeometryKind::shapes && surface.ends_with(endocardium))
    return index_of(voids, surface.substr(0, surface.size() - endocardium.size()));
  return index_of(voids, surface);
}

int void_of_cavity(const Scene& scene, const Mechanics::Cavity& cavity) {
  return index_of(solid_voids(scene), scene.geometry == GeometryKind::shapes ? cavity.shape : cavity.name);
}

std::vector<std::string> solid_part_files(const Scene& scene) {
  switch (scene.geometry) {
    case GeometryKind::heart:
      return {"solid_parts_heart.clh", "solid_tile.clh", "solid_setup.cl"};
    case GeometryKind::box:
      return {"solid_parts_box.clh", "solid_tile.clh", "solid_setup.cl"};
    case GeometryKind::shapes:
      return {"solid_parts_shapes.clh", "solid_tile.clh", "solid_setup.cl"};
    case GeometryKind::labels:
      return {"label_fibres.clh", "solid_tile.clh", "solid_label_fibres.cl"};
    case GeometryKind::none:
      break;
  }
  throw std::invalid_argument("there are no mechanics of this geometry yet");
}

std::string solid_part_source(const Scene& scene) {
  const std::vector<std::string> voids = solid_voids(scene);
  std::string source = "#define VOIDS " + std::to_string(voids.size()) + "\n#define REGION_COUNT " +
                       std::to_string(scene.regions.size()) + "\n";
  if (scene.geometry == GeometryKind::heart) {
    const DeformingWalls walls = deforming_walls(*scene.mechanics);
    return source + "#define SOLID_VENTRICLES " + std::to_string(walls.ventricles) + "\n#define SOLID_LA " +
           std::to_string(walls.la) + "\n#define SOLID_RA " + std::to_string(walls.ra) +
           "\n#define SOLID_DX R(" + std::to_string(solid_dx_mm(scene)) + ")\n";
  }
  if (scene.geometry != GeometryKind::shapes) return source;
  source += "#define SHAPE_VOIDS(inside, beyond)";
  for (size_t k = 0; k < voids.size(); ++k) {
    const bool cavity = k < scene.mechanics->cavities.size();
    const bool beyond = !cavity && side_of_tissue(scene, voids[k]) > 0;
    source += std::string(" ") + (beyond ? "beyond" : "inside") + "(" + std::to_string(k + 1) + ", " +
              voids[k] + ")";
  }
  return source + "\n";
}

}  // namespace cohort
