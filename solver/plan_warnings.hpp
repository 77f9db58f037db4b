#pragma once

#include <span>

#include "solver/monodomain.hpp"
#include "solver/simulation.hpp"
#include "solver/tissue.hpp"

// What runs and yet is odd about a scene: told by the plan.
namespace cohort {

/// The protocol, and for how many members; of the scene's own values where there are none.
void warn_of_protocol(const Scene& scene, std::span<const Member> members, const Member& base);

/// An export of this program that has lost what it says of the heart.
void warn_of_labels(const Scene& scene);

/// Probes outside the tissue of the scene's own values.
void warn_of_probes(const Scene& scene, const Tissue& tissue, const Member& base);

/// Stimuli that reach no cell of the tissue that `monodomain` was assembled for, that of the scene's own
/// values.
void warn_of_stimuli(const Scene& scene, const Monodomain& monodomain);

}  // namespace cohort
