#pragma once

#include <span>
#include <vector>

#include "solver/tissue.hpp"

namespace cohort {

/// Activation features of member `m` in the order of layout(): first and last activation of each excitable
/// region, the activated share of its cells, then each probe. activation: (activation_fields(scene), stride)
/// as kernels/monodomain.cl leaves it. With beats also, by region, the latest activation and the most of one
/// cell; by probe their number, the latest one, APD90 of the latest action potential (NaN where it does not
/// end) and the diastolic interval before it, from probe_potential: (probes, samples) mV, every sampling
/// interval.
std::vector<float> activation_features(const Scene& scene, const Tissue& tissue,
                                       std::span<const float> activation, std::size_t m,
                                       std::span<const double> values,
                                       std::span<const float> probe_potential = {});

/// Names and units of the above.
std::vector<std::pair<std::string, std::string>> activation_feature_names(const Scene& scene);

}  // namespace cohort
