#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/simulation.hpp"

namespace cohort {

/// Declares outputs.pv.* and outputs.displacement.*, as far as the scene asks for them.
void declare_pv_outputs(Scene& scene);

/// What has a pressure and a volume: LV, RV, LA, RA, aorta, pulmonary_artery of the closed loop; LV, aorta of
/// the windkessel; without a circulation the cavities of the mechanics by their names.
std::vector<std::string> pv_compartments(const Scene& scene);

/// How long what is recorded lasts (ms): the last beat, where the scene has beats, else all of it.
double recorded_ms(const Scene& scene);

/// Sample times of pressure and volume, and of displacement (ms), from the start of what is recorded; its end
/// is no sample, since the next beat begins there. Of an equilibrium (mechanics.quasi_static) one sample at 0.
std::vector<double> pv_times_ms(const Scene& scene);
std::vector<double> displacement_times_ms(const Scene& scene);

/// pv_features() of a member's recording; nothing where the scene records no pressure and volume. values: of
/// the member, in table order.
std::vector<float> recorded_pv_features(const Scene& scene, const Recording& recording,
                                        std::span<const double> values);

}  // namespace cohort
