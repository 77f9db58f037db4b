#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Axis-aligned box, mm.
struct Extent {
  std::array<double, 3> lower, upper;
};

/// Ball, mm.
struct Sphere {
  std::array<double, 3> centre;
  double radius;
};

/// Fills scene.regions (heart and box; those of `shapes` are the scene's own) and appends the geometry's
/// parameters: geometry.heart.*, geometry.box.size_mm.*, geometry.shapes.<name>.<kind>.<size>,
/// geometry.fibres.*. Throws
/// std::invalid_argument naming the shape that does not exist, is named twice or stands after its use.
void declare_geometry(Scene& scene);

/// Files of kernels/, in order, that define for this geometry (lengths in mm, P the parameters of one member)
///   int   tissue_region(real3 p, real h, global const real *P, real *fraction);
///   real3 fibre_direction(real3 p, int region, global const real *P);
///   real4 tissue_coordinates(real3 p, int region, global const real *P);
/// (for a label map, whose cells are read and not computed, only what kernels/tissue.cl needs of them),
/// and for the heart  int cavity_region(real3 p, real h, global const real *P, real *fraction).
/// They are documented in kernels/geometry_heart.clh. The program also needs parameter_macros() and
/// geometry_source().
std::vector<std::string> geometry_files(const Scene& scene);

/// Macros that stand before those files: REGION_<name>, and what the shapes of the scene generate.
std::string geometry_source(const Scene& scene);

/// A box that holds every surface of the tissue; a partly filled cell reaches less than one cell beyond. The
/// grid that takes it in must have its faces at multiples of the spacing, so that one lies on z = 0, the
/// heart's base. `values`: one for every parameter, table order, resolved, mm. Throws std::invalid_argument
/// for shapes without bounds (a half-space that nothing cuts).
Extent geometry_extent(const Scene& scene, std::span<const double> values);

/// Place and size of a named stimulus site. Throws std::invalid_argument naming the sites there are.
Sphere site(const Scene& scene, const std::string& name, std::span<const double> values);

}  // namespace cohort
