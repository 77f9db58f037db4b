#pragma once

#include <string>
#include <utility>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Declares electrophysiology.*: membrane and tissue constants, the parameters of each cell model that a
/// region has, for each excitable region of scene.regions its own copies of the conductivities and of its
/// model's parameters, which inherit while they are not set, and the heterogeneity. Throws
/// std::invalid_argument for a model of a region that does not exist or is not excitable.
void declare_electrophysiology(Scene& scene);

/// Why the scene has no electrophysiology parameter `name` (the last part of its path) though another method
/// of activation would read it; empty for any other name.
std::string unread_parameter(const Scene& scene, const std::string& name);

/// Declares stimuli.<name>.*, for the stimuli of the scene.
void declare_stimuli(Scene& scene);

/// Where the parameters of regions stand in the table. Tissue: region r (excitable) has a run of `stride`
/// numbers from first + stride slot[r], in pairs along and across fibres; an offset is -1 where the scene's
/// equations do not read what would stand there.
/// Cells: region r has its model's parameters, in the model's order, from cell_first[r] on, and model m of
/// CellModels its own, from which they inherit, from model_first[m] on.
struct RegionParameters {
  int first, stride, slots;
  int conductivity_offset;       ///< not with the bidomain equations, nor with eikonal
  int intracellular_offset;      ///< always
  int velocity_offset;           ///< not where activation is set to monodomain or bidomain
  int extracellular_offset;      ///< bidomain only
  std::vector<int> slot;         ///< by region; -1 where not excitable
  std::vector<int> bath;         ///< by region: its bath's conductivity, or -1
  std::vector<int> cell_first;   ///< by region; -1 where not excitable
  std::vector<int> model_first;  ///< by model
};
RegionParameters region_parameters(const Scene& scene);

/// Of the regions' conductivities and velocities whose names begin so: place in the table and the value that
/// stands there unless it is set.
std::vector<std::pair<int, double>> region_defaults(const Scene& scene, const std::string& beginning);

}  // namespace cohort
