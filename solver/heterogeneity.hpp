#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/cell_model.hpp"
#include "solver/scene.hpp"

// Cell parameters that vary through the wall of a region: p = p_region + sum over the bases of slope x basis,
// kept within the parameter's range. Bases from the tissue's coordinates u (transmural), a (apico-basal) and
// phi (around the axis):
//   transmural u - 1/2, apico_basal a - 1/2, lateral cos phi, anterior sin phi,
//   endocardial, midmyocardial, epicardial: 1 in that layer of the wall, else 0.
namespace cohort {

/// Bases that the scene's geometry has coordinates for; none in a box.
std::vector<std::string> heterogeneity_bases(const Scene& scene);

/// Whether a region of the scene has a wall: an inner and an outer surface between which it varies.
bool has_wall(const Scene& scene, const Region& region);

/// Names of the parameters electrophysiology.heterogeneity.<name> that bound the layers.
std::vector<std::string> layer_bounds();

/// Why the layers of a member with these values are none; empty where they are, or nothing varies.
std::string layer_defect(const Scene& scene, std::span<const double> values);

/// Whether each region of scene.regions takes part: those named, else the ventricles of the heart, else every
/// excitable region with a wall.
std::vector<bool> heterogeneous_regions(const Scene& scene);

/// Declares electrophysiology.heterogeneity.*: a slope for each parameter and basis, the bounds of the
/// layers. Throws std::invalid_argument for regions without a wall, parameters that no model there has.
void declare_heterogeneity(Scene& scene);

/// Macro HETEROGENEITY(p, P, basis) for the kernels: adds the slopes to the parameters p of one cell of
/// `model`. Empty where none of its parameters varies.
std::string heterogeneity_source(const Scene& scene, const CellModel& model);

/// Whether the values of a member give parameter `name` a slope.
bool has_slope(const Scene& scene, const std::string& name, const std::vector<double>& values);

}  // namespace cohort
