#pragma once

#include "solver/cell_model.hpp"
#include "solver/scene.hpp"

namespace cohort {

/// Declares electrophysiology.*: membrane and tissue constants, the cell model's parameters, and for each
/// excitable region of scene.regions its own copies of them, which inherit while they are not set.
void declare_electrophysiology(Scene& scene);

/// Declares stimuli.<name>.*, for the stimuli of the scene.
void declare_stimuli(Scene& scene);

/// Where the parameters of regions stand in the table: region r (excitable) has a run of `stride` numbers
/// from first + stride slot[r]: conductivities along and across, intracellular conductivities along and
/// across, velocities along and across, then the cell model's parameters in its order from `cell_offset` on.
struct RegionParameters {
  int first, stride, cell_offset, intracellular_offset, velocity_offset, slots;
  std::vector<int> slot;  ///< by region; -1 where not excitable
  int cell_first;         ///< index of the cell model's first own parameter
};
RegionParameters region_parameters(const Scene& scene, const CellModel& model);

}  // namespace cohort
