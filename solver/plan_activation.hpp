#pragma once

#include <span>
#include <string>

#include "solver/simulation.hpp"

// What activates the tissue: told by the plan, and chosen where the scene leaves it open.
namespace cohort {

/// Why the scene has no ECG without a time loop; empty where it can. A velocity that is sampled need not
/// stand in the scene.
std::string projection_refusal(const Scene& scene, const Member& base, std::span<const Member> members);

/// Fronts of the scene's own values, and what activates the tissue where the scene leaves it open.
/// Throws std::invalid_argument.
void choose_activation(Device& device, const Scene& scene, const Member& base,
                       std::span<const Member> members, double dx_mm, Plan& plan);

}  // namespace cohort
