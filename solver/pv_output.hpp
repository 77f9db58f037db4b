#pragma once

#include <span>
#include <string>
#include <utility>
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
/// is no sample, since the next beat begins there. Of an equilibrium (mechanics.quasi_static) one sample at
/// 0.
std::vector<double> pv_times_ms(const Scene& scene);
std::vector<double> displacement_times_ms(const Scene& scene);

/// Names and units of what a heart says of its own soundness, the last of layout()'s features: beats and the
/// difference of the last two; with cavities of tissue the most switches of valves in a beat, pressure that
/// alternates from step to step, blood of a cavity less its volume, and the smallest volume ratio of a cell.
std::vector<std::pair<std::string, std::string>> heart_check_names(const Scene& scene);

/// pv_features() of a member's recording; nothing where the scene records no pressure and volume. values: of
/// the member, in table order.
std::vector<float> recorded_pv_features(const Scene& scene, const Recording& recording,
                                        std::span<const double> values);

}  // namespace cohort
