#pragma once

#include <span>

namespace cohort {

/// Lobes of a closed curve: connected parts of the plane round which it runs, by the sign of its winding
/// number.
struct LoopLobes {
  int counterclockwise = 0, clockwise = 0;
  /// One lobe of either orientation: the curve crosses itself between them.
  bool figure_of_eight() const { return counterclockwise == 1 && clockwise == 1; }
};

/// Lobes of the closed polygon through (x[i], y[i]), both axes scaled to its extent. Those below 1 % of the
/// area of all do not count. Strands that touch or run along each other, as the loop of an atrium does on its
/// passive line, enclose nothing, so that rounding there makes no lobe; crossings of such strands could not
/// be counted. No NaN may stand in x and y.
LoopLobes loop_lobes(std::span<const double> x, std::span<const double> y);

}  // namespace cohort
