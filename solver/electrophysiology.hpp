#pragma once

#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Declares electrophysiology.*: membrane and tissue constants, the parameters of each cell model that a
/// region has, for each excitable region of scene.regions its own copies of the conductivities and of its
/// model's parameters, which inherit while they are not set, and the heterogeneity. Throws
/// std::invalid_argument for a model of a region that does not exist or is not excitable.
void declare_electrophysiology(Scene& scene);

/// Declares stimuli.<name>.*, for the stimuli of the scene.
void declare_stimuli(Scene& scene);

/// Where the parameters of regions stand in the table. Tissue: region r (excitable) has a run of `stride`
/// numbers from first + stride slot[r]: conductivities along and across, intracellular conductivities along
/// and across, velocities along and across, and with the bidomain equations the extracellular conductivities.
/// Cells: region r has its model's parameters, in the model's order, from cell_first[r] on, and model m of
/// CellModels its own, from which they inherit, from model_first[m] on.
struct RegionParameters {
  int first, stride, intracellular_offset, velocity_offset, slots;
  int extracellular_offset;      ///< bidomain only
  std::vector<int> slot;         ///< by region; -1 where not excitable
  std::vector<int> bath;         ///< by region: its bath's conductivity, or -1
  std::vector<int> cell_first;   ///< by region; -1 where not excitable
  std::vector<int> model_first;  ///< by model
};
RegionParameters region_parameters(const Scene& scene);

}  // namespace cohort
