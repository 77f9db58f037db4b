#pragma once

#include <span>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Numbers of one stimulus as kernels/stimulus.clh lays them out.
inline constexpr int stimulus_numbers = 12;

/// The stimuli of one member, (stimuli, stimulus_numbers).
std::vector<double> stimulus_block(const Scene& scene, std::span<const double> values);

/// Whether any stimulus of a block is on during a part of [time, time + dt], ms.
bool stimulus_on(std::span<const double> block, double time, double dt);

}  // namespace cohort
