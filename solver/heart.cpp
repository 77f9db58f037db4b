// The schematic heart on the host: its parameters, extent and stimulus sites. Formulas as in
// kernels/geometry_heart.clh.
#include <algorithm>
#include <cmath>

#include "solver/geometry_kinds.hpp"

namespace cohort {

namespace {

const std::string prefix = "geometry.heart.";
const char* tuned = "fitted to normal volumes, wall masses and ECG";

using Vector = std::array<double, 3>;

Vector operator+(Vector a, const Vector& b) {
  for (size_t i = 0; i < 3; ++i) a[i] += b[i];
  return a;
}

Vector operator*(double s, Vector a) {
  for (double& x : a) x *= s;
  return a;
}

Extent box_about(const Vector& centre, const Vector& half) {
  return {centre + -1.0 * half, centre + half};
}

/// Reads geometry.heart.* of one member.
struct Sizes {
  const ParameterTable& table;
  std::span<const double> values;

  double operator()(const std::string& name) const {
    return values[static_cast<size_t>(table.index(prefix + name))];
  }
  Vector vector(const std::string& name) const {
    return {(*this)(name + ".x"), (*this)(name + ".y"), (*this)(name + ".z")};
  }
};

struct Atria {
  Vector la_centre, la_radii, ra_centre, ra_radii;
  double wall, plate;
};

Atria atria(const Sizes& size) {
  const double a = size("lv_radius_mm"), plate = size("av_plate_mm");
  const Vector la = size.vector("la_radius_mm"), ra = size.vector("ra_radius_mm");
  const Vector la_centre = {-0.32 * a, -0.4 * a, plate + 0.77 * la[2]};
  const Vector ra_centre = {la_centre[0] + la[0] + ra[0], -0.4 * a, plate + 0.72 * ra[2]};
  return {la_centre, la, ra_centre, ra, size("atrial_wall_mm"), plate};
}

/// Box of a cylinder from `origin` along the unit `axis`.
Extent cylinder_box(const Vector& origin, const Vector& axis, double radius, double length) {
  Vector half;
  for (size_t i = 0; i < 3; ++i) half[i] = radius * std::sqrt(std::max(0.0, 1 - axis[i] * axis[i]));
  return hull(box_about(origin, half), box_about(origin + length * axis, half));
}

double septum_at_base(const Sizes& size, double y) {
  const double a = size("lv_radius_mm"), L = size("lv_length_mm"), equator = size("lv_equator_fraction") * L;
  const double wall = size("lv_wall_mm"), septum = size("septum_mm");
  const auto half_width = [&](double rx, double ry, double rz) {
    return rx * std::sqrt(std::max(0.0, 1 - std::pow(equator / rz, 2) - std::pow(y / ry, 2)));
  };
  const double inner = half_width(a, a, L - equator);
  const double outer = half_width(a + 0.5 * (septum + wall), a + wall, L - equator + size("apex_mm"));
  return 0.5 * (inner + 0.5 * (septum - wall) + outer);
}

}  // namespace

void declare_heart(Scene& scene) {
  using Fibres = Region::Fibres;
  const auto region = [](const char* name, bool excitable, Fibres fibres) {
    return Region{.name = name, .shape = {}, .excitable = excitable, .fibres = fibres};
  };
  scene.regions = {
      region("lv", true, Fibres::transmural),       region("rv", true, Fibres::transmural),
      region("la", true, Fibres::transmural),       region("ra", true, Fibres::transmural),
      region("bachmann", true, Fibres::transmural), region("insulator", false, Fibres::none),
      region("aorta", false, Fibres::none),         region("pulmonary_artery", false, Fibres::none)};
  // Where the delay of the atrioventricular node stands for the path, it is ordinary septum and plate.
  const bool path = !scene.conduction_system || scene.conduction_system->kind == ConductionSystem::Kind::path;
  if (path)
    scene.regions.insert(scene.regions.begin() + 4, region("conduction_path", true, Fibres::transmural));

  ParameterTable& table = scene.parameters;
  const auto mm = [&](const char* name, double value, double lower, double upper, const char* meaning) {
    table.add({prefix + name, "mm", value, lower, upper, meaning, tuned});
  };
  const auto fraction = [&](const char* name, double value, double lower, double upper, const char* meaning) {
    table.add({prefix + name, "1", value, lower, upper, meaning, tuned});
  };
  fraction("scale", 1, 0.1, 3, "factor on all sizes and places");
  mm("lv_radius_mm", 25, 10, 50, "radius of the left ventricular cavity at its equator");
  mm("lv_length_mm", 90, 40, 150, "from the AV plane to the apex of the left ventricular cavity");
  fraction("lv_equator_fraction", 0.278, 0.1, 0.45, "depth of the equator below the AV plane over lv_length");
  mm("lv_wall_mm", 9.5, 3, 25, "free wall of the left ventricle");
  mm("septum_mm", 9, 3, 25, "interventricular septum");
  mm("apex_mm", 7, 2, 20, "wall at the left ventricular apex");
  mm("rv_width_mm", 27, 12, 50, "right ventricular cavity from septum to free wall");
  fraction("rv_height_fraction", 1.19, 0.8, 1.6,
           "right ventricular semi-axis along y over the left ventricle's outer radius");
  fraction("rv_length_fraction", 0.844, 0.6, 1, "length of the right ventricle over lv_length");
  mm("rv_wall_mm", 3.8, 1.5, 12, "free wall of the right ventricle");
  mm("rv_outflow_radius_mm", 13, 6, 20, "radius of the right ventricular outflow");
  mm("smoothing_mm", 8, 0, 20, "length over which the right ventricle and its outflow blend");
  mm("atrial_wall_mm", 2.6, 1, 6, "wall of both atria");
  mm("av_plate_mm", 4, 1, 10, "insulating plate between atria and ventricles; at least one cell");
  table.add_vector({prefix + "la_radius_mm", "mm", 0, 10, 50, "semi-axis of the left atrial cavity", tuned},
                   24, 27, 22);
  table.add_vector({prefix + "ra_radius_mm", "mm", 0, 10, 50, "semi-axis of the right atrial cavity", tuned},
                   24, 29, 25);
  mm("aorta_radius_mm", 10.5, 5, 20, "lumen of the aorta");
  mm("aorta_wall_mm", 2, 0.5, 5, "wall of the aorta");
  mm("aorta_length_mm", 45, 10, 100, "aorta above the AV plane");
  mm("pulmonary_artery_radius_mm", 11.5, 5, 20, "lumen of the pulmonary artery");
  mm("pulmonary_artery_wall_mm", 1.5, 0.5, 5, "wall of the pulmonary artery");
  mm("pulmonary_artery_length_mm", 30, 5, 100, "pulmonary artery beyond its valve");
  fraction("mitral_radius_fraction", 0.52, 0.3, 0.6, "mitral orifice over lv_radius");
  mm("tricuspid_radius_mm", 13, 6, 20, "tricuspid orifice");
  mm("conduction_path_radius_mm", 3, 1, 6, "path that joins atria and ventricles; at least one cell thick");
  mm("conduction_path_length_mm", 20, 4, 40, "path below the AV plane, in the septum");
  mm("av_node_height_mm", 6, 2, 12, "atrioventricular node above the AV plate");
  mm("bachmann_radius_mm", 4, 1, 8, "Bachmann's bundle; at least one cell thick");
  mm("sinoatrial_node_radius_mm", 4, 1, 10, "ball in which the sinoatrial node fires");
}

Extent heart_extent(const ParameterTable& table, std::span<const double> values) {
  const Sizes size{table, values};
  const double a = size("lv_radius_mm"), L = size("lv_length_mm"), equator = size("lv_equator_fraction") * L;
  const double wall = size("lv_wall_mm"), septum = size("septum_mm"), outer = a + wall;

  Extent box = box_about({0.5 * (septum - wall), 0, -equator},
                         {a + 0.5 * (septum + wall), outer, L - equator + size("apex_mm")});

  const double rv_x = 0.61 * outer, rv_z = -0.88 * equator,
               rv_wall = size("rv_wall_mm") + 0.25 * size("smoothing_mm");
  box = hull(box, box_about({rv_x, 0, rv_z}, {a + septum + size("rv_width_mm") - rv_x + rv_wall,
                                              size("rv_height_fraction") * outer + rv_wall,
                                              size("rv_length_fraction") * L + rv_z + rv_wall}));
  // Bodies of the ventricles end at z = 0.
  box.upper[2] = 0;

  const Vector root = {1.10 * outer, 0.52 * outer, -0.2 * L}, valve = {0.43 * outer, 1.10 * outer, 0.4 * a};
  const Vector valve_axis = {-0.4528, 0.2516, 0.8554};
  const double outflow = size("rv_outflow_radius_mm") + rv_wall;
  box = hull(box, box_about(root, {outflow, outflow, outflow}));
  box = hull(box, box_about(valve, {outflow, outflow, outflow}));
  box = hull(box, cylinder_box(valve, valve_axis,
                               size("pulmonary_artery_radius_mm") + size("pulmonary_artery_wall_mm"),
                               size("pulmonary_artery_length_mm")));
  box = hull(box, cylinder_box({0.36 * a, 0.36 * a, 0}, {0.0485, 0.2423, 0.9690},
                               size("aorta_radius_mm") + size("aorta_wall_mm"), size("aorta_length_mm")));

  const Atria b = atria(size);
  const double bundle =
      size("bachmann_radius_mm");  // the bundle stands out of the wall, whose middle it follows
  const double atrial = std::max(b.wall, 0.5 * b.wall + bundle);
  box = hull(box, box_about(b.la_centre, b.la_radii + Vector{b.wall, b.wall, atrial}));
  box = hull(box, box_about(b.ra_centre, b.ra_radii + Vector{b.wall, b.wall, atrial}));

  const double scale = size("scale");
  return {scale * box.lower, scale * box.upper};
}

Sphere heart_site(const ParameterTable& table, const std::string& name, std::span<const double> values) {
  const Sizes size{table, values};
  const Atria b = atria(size);
  const double scale = size("scale"), y = b.ra_centre[1], path = size("conduction_path_radius_mm");

  if (name == "his_bundle") return {scale * Vector{septum_at_base(size, y), y, 0}, scale * path};

  const Vector middle = b.ra_radii + Vector{0.5 * b.wall, 0.5 * b.wall, 0.5 * b.wall};
  if (name == "av_node") {
    const double z = b.plate + size("av_node_height_mm");
    const double rim = 1 - std::pow((z - b.ra_centre[2]) / middle[2], 2);
    return {scale * Vector{b.ra_centre[0] - middle[0] * std::sqrt(std::max(0.0, rim)), y, z}, scale * path};
  }
  // Sinoatrial node: direction in units of the semi-axes, projected to the middle of the wall.
  const Vector d = {0.45, 0.72, 0.6};
  const double length = std::hypot(d[0], d[1], d[2]);
  Vector node = b.ra_centre;
  for (size_t i = 0; i < 3; ++i) node[i] += d[i] / length * middle[i];
  return {scale * node, scale * size("sinoatrial_node_radius_mm")};
}

}  // namespace cohort
