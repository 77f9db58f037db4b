#pragma once

#include <map>
#include <vector>

#include "solver/device.hpp"
#include "solver/scene.hpp"

namespace cohort {

/// A cable of one cell model: the model's parameters in its order, and the stimulus that starts the front.
struct Cable {
  std::string cell_model;
  std::vector<double> cell;
  double threshold_mV;         ///< activation: first rise through it
  double amplitude_mV_per_ms;  ///< of the stimulus
  double duration_ms;
  auto operator<=>(const Cable&) const = default;
};

/// A plane front, for a diffusivity of 1 mm2/ms: speed and length grow with the root of the diffusivity.
struct Front {
  double speed = 0;       ///< mm/ms; 0 where the cable does not conduct
  double width_mm = 0;    ///< amplitude over steepest slope in space
  double latency_ms = 0;  ///< from the start of the stimulus until the front leaves the stimulated stretch:
                          ///< arrival times behind it, extrapolated to its edge at the front's speed
};

/// Plane fronts from one-dimensional cables, run on the device with the time loop's own kernels. Results are
/// kept, so that members with the same parameters share them. Nothing depends on which cables are asked for
/// together.
class Conduction {
 public:
  Conduction(Device& device, Precision precision) : device_(device), precision_(precision) {}

  /// Converged in space and time: two runs, the second of half the spacing and a quarter of the step, and
  /// Richardson's extrapolation; finer again until the runs differ by less than `tolerance`.
  std::vector<Front> converged(const std::vector<Cable>& cables);

  /// Time from the start of each cable's stimulus to its threshold, where it acts everywhere; negative where
  /// it does not lift the cell so far.
  std::vector<double> uniform_latency(const std::vector<Cable>& cables);

  /// Speed (mm/ms for 1 mm2/ms) on a grid of `spacing` mm / sqrt(mm2/ms) = dx / sqrt(D); 0 where it does not
  /// conduct.
  double on_grid(const Cable& cable, double spacing);

  static constexpr double tolerance = 0.06;  ///< of the speed; what is left after Richardson is a tenth of it

 private:
  std::vector<Front> run(const std::vector<Cable>& cables, double spacing, bool uniform);

  Device& device_;
  Precision precision_;
  std::map<Cable, Front> known_;
  std::map<Cable, double> known_uniform_;
  std::map<std::pair<Cable, double>, double> known_on_grid_;
};

}  // namespace cohort
