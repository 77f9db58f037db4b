#pragma once

#include "solver/scene.hpp"

namespace cohort {

/// Steps of one member. They depend on the scene and the member alone, and come from a short ladder, so that
/// members of a batch usually share them.
struct TimeSteps {
  double dt_ms;    ///< of the reaction and the splitting
  int per_sample;  ///< steps between two samples
  int substeps;    ///< explicit diffusion steps in each
  bool operator==(const TimeSteps&) const = default;
};

/// Interval between samples (ms): of the ECG, or of the checks where there is none.
double sampling_interval_ms(const Scene& scene);

/// Samples of a run, the last one at its end aside.
int samples_of(const Scene& scene);

/// time.dt_ms where it is given, else the largest step of the ladder that resolves the cell model's fastest
/// rate (1/ms), times `factor` (time.step_factor), rounded down to a share of the sampling interval; substeps
/// keep diffusion below its explicit limit (ms), and are no fewer than those of factor 1. Throws
/// std::invalid_argument when a given dt does not divide the sampling interval, std::runtime_error when
/// diffusion would take more than 1024 substeps.
TimeSteps choose_steps(const Scene& scene, double fastest_rate, double diffusion_limit_ms, double factor = 1);

/// The longest step that explicit rules bear at this rate (1/ms); the ladder takes a tenth of it.
inline double reaction_limit_ms(double fastest_rate) {
  return 2 / fastest_rate;
}

/// Throws std::invalid_argument as above; for a check before any device work.
void check_given_step(const Scene& scene);

}  // namespace cohort
