#pragma once

#include <span>
#include <vector>

#include "solver/tissue.hpp"

namespace cohort {

/// Activation features of member `m` in the order of layout(): first and last activation of each excitable
/// region, the activated share of its cells, then each probe. activation: (stride) ms, negative where not
/// activated.
std::vector<float> activation_features(const Scene& scene, const Tissue& tissue,
                                       std::span<const float> activation, std::size_t m,
                                       std::span<const double> values);

/// Names and units of the above.
std::vector<std::pair<std::string, std::string>> activation_feature_names(const Scene& scene);

}  // namespace cohort
