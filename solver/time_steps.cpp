#include "solver/time_steps.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "solver/pv_output.hpp"

namespace cohort {

double sampling_interval_ms(const Scene& scene) {
  return scene.ecg ? 1000.0 / scene.parameters.value("outputs.ecg.rate_hz") : 1.0;
}

int samples_of(const Scene& scene) {
  constexpr double rounding = 1e-9;
  return static_cast<int>(std::ceil(recorded_ms(scene) / sampling_interval_ms(scene) - rounding));
}

void check_given_step(const Scene& scene) {
  const double dt = scene.parameters.value("time.dt_ms");
  if (dt <= 0) return;
  const double interval = sampling_interval_ms(scene), ratio = interval / dt;
  constexpr double tolerance = 1e-6;
  if (std::round(ratio) < 1 || std::abs(ratio - std::round(ratio)) > tolerance * ratio) {
    std::ostringstream text;
    text << "time.dt_ms is " << dt << " ms; it must divide the sampling interval of " << interval << " ms";
    throw std::invalid_argument(text.str());
  }
}

TimeSteps choose_steps(const Scene& scene, double fastest_rate, double diffusion_limit_ms, double factor) {
  check_given_step(scene);
  const double interval = sampling_interval_ms(scene), given = scene.parameters.value("time.dt_ms");
  TimeSteps steps{};
  if (given > 0) {
    steps.per_sample = static_cast<int>(std::lround(interval / given));
  } else {
    // A fifth of the fastest time constant: the midpoint rule's error is then below 1 % of the upstroke's
    // rate.
    constexpr double resolution = 0.2;
    steps.per_sample = 1;
    for (const int coarse : {2, 5, 10})
      if (interval / steps.per_sample * fastest_rate > resolution) steps.per_sample = coarse;
    constexpr int most = 1 << 24;
    while (interval / steps.per_sample * fastest_rate > resolution && steps.per_sample < most)
      steps.per_sample *= 2;
  }
  const double plain_ms = interval / steps.per_sample;
  constexpr double rounding = 1e-9;
  steps.per_sample = std::max(1, static_cast<int>(std::ceil(steps.per_sample / factor - rounding)));
  steps.dt_ms = interval / steps.per_sample;

  // Steps of diffusion shorten with those of the reaction: half the step is half of all that is split.
  constexpr double safety = 0.95;
  constexpr int most_substeps = 1024;
  const double longest_ms = std::max(plain_ms, steps.dt_ms);
  steps.substeps = 1;
  while (longest_ms / steps.substeps > safety * diffusion_limit_ms) {
    steps.substeps *= 2;
    if (steps.substeps > most_substeps)
      throw std::runtime_error("explicit diffusion is stable up to " + std::to_string(diffusion_limit_ms) +
                               " ms only: more than " + std::to_string(most_substeps) + " substeps of " +
                               std::to_string(longest_ms) + " ms");
  }
  return steps;
}

}  // namespace cohort
