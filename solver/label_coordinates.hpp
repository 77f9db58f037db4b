#pragma once

#include "solver/labels.hpp"

namespace cohort {

/// Fills `direction` and `coordinates` of every tissue cell of `cells`, from its regions and landmarks. u and
/// the distance as in tissue_coordinates of kernels/geometry_heart.clh, the analytic surfaces replaced by
/// those of the labels.
void locate(const FineLabels& fine, const LabelHeart& heart, LabelCells& cells);

}  // namespace cohort
