#pragma once

#include <vector>

#include "solver/simulation.hpp"

namespace cohort {

/// A scene at half the spacing and half the step: the grid's and that of the mechanics, time.dt_ms and
/// circulation.dt_ms, or time.step_factor where the scene has it, which scales both. A step that follows from
/// the spacing halves by itself; torso.dx_mm stays, it is the field's and not the heart's.
Scene half_steps(Scene scene);

/// The values of a member likewise.
Member half_steps(const Scene& scene, Member member);

}  // namespace cohort
