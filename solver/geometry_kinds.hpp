#pragma once

#include <span>
#include <string>

#include "solver/geometry.hpp"

// What geometry.cpp asks of each kind of geometry. Errors as in geometry.hpp.
namespace cohort {

void declare_heart(Scene& scene);
Extent heart_extent(const ParameterTable& table, std::span<const double> values);
Sphere heart_site(const ParameterTable& table, const std::string& name, std::span<const double> values);

void declare_shapes(Scene& scene);
Extent shapes_extent(const Scene& scene, std::span<const double> values);
std::string shapes_source(const Scene& scene);

void declare_labels(Scene& scene);
Extent labels_extent(const Scene& scene);
Sphere labels_site(const Scene& scene, const std::string& name);
/// Value of geometry.grown.<name>, 0 where the label map has no use for it.
double label_size(const Scene& scene, const std::string& name);

/// Smallest box that holds both.
Extent hull(const Extent& a, const Extent& b);

}  // namespace cohort
