#pragma once

#include <span>
#include <vector>

namespace cohort {

/// How a closed curve runs through itself.
struct LoopCrossings {
  int count = 0;                 ///< transversal self-intersections
  bool figure_of_eight = false;  ///< one of them, between two lobes of opposite orientation
};

/// Self-intersections of the closed polygon through (x[i], y[i]). Both axes are scaled to the curve's extent.
/// A crossing counts where what it cuts off is larger than 1 % of the curve's convex hull: strands that touch
/// or run along each other count once where they change sides, else not at all. No NaN may stand in x and y.
LoopCrossings loop_crossings(std::span<const double> x, std::span<const double> y);

}  // namespace cohort
