#pragma once

#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// What surrounds the deforming tissue, by name, in the order of kernels/solid_setup.cl (void k is entry
/// k - 1): the blood of cavities, and what lies beyond named surfaces. Throws std::invalid_argument naming
/// the surface or shape that does not bound the tissue.
std::vector<std::string> solid_voids(const Scene& scene);

/// The void beyond a surface of the scene: of a shape, "epicardium", "base", "lv_endocardium",
/// "rv_endocardium", "x_lower" ... "z_upper" of a box. -1 where there is none.
int void_of_surface(const Scene& scene, const std::string& surface);

/// Void of a cavity of the mechanics.
int void_of_cavity(const Scene& scene, const Mechanics::Cavity& cavity);

/// Files and generated source of what finds parts and fibres, behind those of the geometry.
std::vector<std::string> solid_part_files(const Scene& scene);
std::string solid_part_source(const Scene& scene);

}  // namespace cohort
