#include "solver/geometry.hpp"

#include <algorithm>
#include <stdexcept>

#include "solver/geometry_kinds.hpp"
#include "solver/labels.hpp"

namespace cohort {

namespace {

void declare_box(Scene& scene) {
  scene.regions = {{.name = "tissue", .shape = {}, .excitable = true, .fibres = Region::Fibres::constant}};
  scene.parameters.add_vector(
      {"geometry.box.size_mm", "mm", 0, 1e-3, 1000, "edge of the box, from the origin",
       "a slab of 20 x 7 x 3 mm: Niederer et al. 2011"},
      20, 7, 3);
}

void declare_fibres(Scene& scene) {
  const auto has = [&](Region::Fibres rule) {
    return std::any_of(scene.regions.begin(), scene.regions.end(),
                       [&](const Region& r) { return r.fibres == rule; });
  };
  if (has(Region::Fibres::constant))
    scene.parameters.add_vector(
        {"geometry.fibres.direction", "1", 0, -1, 1,
         "component of the constant fibre direction, of any length; zero for none", "convention"},
        1, 0, 0);
  if (has(Region::Fibres::transmural)) {
    scene.parameters.add({"geometry.fibres.endocardium_deg", "deg", 60, -90, 90,
                          "helix angle at the endocardium, positive right-handed", "Streeter et al. 1969"});
    scene.parameters.add({"geometry.fibres.epicardium_deg", "deg", -60, -90, 90,
                          "helix angle at the epicardium", "Streeter et al. 1969"});
  }
}

}  // namespace

Extent hull(const Extent& a, const Extent& b) {
  Extent result = a;
  for (size_t axis = 0; axis < 3; ++axis) {
    result.lower[axis] = std::min(a.lower[axis], b.lower[axis]);
    result.upper[axis] = std::max(a.upper[axis], b.upper[axis]);
  }
  return result;
}

void declare_geometry(Scene& scene) {
  switch (scene.geometry) {
    case GeometryKind::none:
      return;
    case GeometryKind::box:
      declare_box(scene);
      break;
    case GeometryKind::heart:
      declare_heart(scene);
      break;
    case GeometryKind::shapes:
      declare_shapes(scene);
      break;
    case GeometryKind::labels:
      declare_labels(scene);
      break;
  }
  declare_fibres(scene);
}

std::vector<std::string> geometry_files(const Scene& scene) {
  switch (scene.geometry) {
    case GeometryKind::box:
      return {"signed_distance.clh", "fibres.clh", "geometry_box.clh"};
    case GeometryKind::heart:
      return {"signed_distance.clh", "fibres.clh", "geometry_heart.clh"};
    case GeometryKind::shapes:
      return {"signed_distance.clh", "fibres.clh", "geometry_shapes.clh"};
    case GeometryKind::labels:
      return {"signed_distance.clh", "fibres.clh"};
    case GeometryKind::none:
      break;
  }
  throw std::logic_error("no geometry");
}

std::string geometry_source(const Scene& scene) {
  std::string source;
  for (size_t i = 0; i < scene.regions.size(); ++i)
    source += "#define REGION_" + scene.regions[i].name + " " + std::to_string(i) + "\n";
  if (scene.geometry == GeometryKind::shapes) source += shapes_source(scene);
  if (scene.geometry == GeometryKind::labels) {
    source += "#define LABEL_FIBRES {";
    for (const Region& region : scene.regions)
      source += std::to_string(static_cast<int>(label_fibres(*scene.labels, region.name))) + ",";
    source += "}\n";
  }
  return source;
}

Extent geometry_extent(const Scene& scene, std::span<const double> values) {
  switch (scene.geometry) {
    case GeometryKind::box: {
      const auto first = values.begin() + scene.parameters.index("geometry.box.size_mm.x");
      return {{0, 0, 0}, {first[0], first[1], first[2]}};
    }
    case GeometryKind::heart:
      return heart_extent(scene.parameters, values);
    case GeometryKind::shapes:
      return shapes_extent(scene, values);
    case GeometryKind::labels:
      return labels_extent(scene);
    case GeometryKind::none:
      break;
  }
  throw std::logic_error("no geometry");
}

std::vector<std::string> stimulus_sites(GeometryKind geometry) {
  if (geometry == GeometryKind::heart || geometry == GeometryKind::labels)
    return {"sinoatrial_node", "av_node", "his_bundle"};
  return {};
}

Sphere site(const Scene& scene, const std::string& name, std::span<const double> values) {
  const std::vector<std::string> names = stimulus_sites(scene.geometry);
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    std::string known;
    for (const std::string& n : names) known += (known.empty() ? "" : ", ") + n;
    throw std::invalid_argument("no stimulus site \"" + name +
                                "\"; there are: " + (known.empty() ? "none" : known));
  }
  if (scene.geometry == GeometryKind::labels) return labels_site(scene, name);
  return heart_site(scene.parameters, name, values);
}

}  // namespace cohort
