#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Numbers of one stimulus as kernels/stimulus.clh lays them out.
inline constexpr int stimulus_numbers = 13;

/// The stimuli of one member, (stimuli, stimulus_numbers).
std::vector<double> stimulus_block(const Scene& scene, std::span<const double> values);

/// Whether any stimulus of a block is on during a part of [time, time + dt], ms.
bool stimulus_on(std::span<const double> block, double time, double dt);

/// What is odd about the protocol of these values: pulses that never fire, trains of one pulse, pulses that
/// overlap. Sentences that name the stimulus, and no number that a campaign may sample.
std::vector<std::string> stimulus_warnings(const Scene& scene, std::span<const double> values);

}  // namespace cohort
