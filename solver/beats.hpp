#pragma once

#include <limits>
#include <span>
#include <vector>

namespace cohort {

/// An action potential at one place, ms. NaN where the recording ends, or the next one comes, before it.
struct Beat {
  double activation_ms;
  double repolarisation_ms = std::numeric_limits<double>::quiet_NaN();
};

/// The action potentials of potential (samples) mV at 0, interval_ms, ...: activation is the rise through
/// threshold_mV, repolarisation the fall, after the peak, through the level a tenth of the amplitude above
/// the least potential since the beat before (APD90); both by linear interpolation between samples.
std::vector<Beat> beats(std::span<const float> potential, double interval_ms, double threshold_mV);

}  // namespace cohort
