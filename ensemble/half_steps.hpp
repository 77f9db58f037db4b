#pragma once

#include <vector>

#include "solver/simulation.hpp"

namespace cohort {

/// A scene at half the spacing and half the step: the grid's and that of the mechanics, time.dt_ms and
/// circulation.dt_ms, or time.step_factor where the scene has it, which scales both. A step that follows from
/// the spacing halves by itself; torso.dx_mm stays, it is the field's and not the heart's.
///
/// Beats that go on until two agree agree to a quarter of time.beats.until_periodic, within twice as many:
/// differences of beats fall geometrically, and with them what is still to come, so that a quarter is an
/// error of second order; taken for one of first it is told half as large again. A half would often end with
/// the same beat where beats settle fast. A given number of beats (until_periodic 0, or at_most 1) has no
/// such error and stays.
Scene half_steps(Scene scene);

/// The values of a member likewise.
Member half_steps(const Scene& scene, Member member);

}  // namespace cohort
