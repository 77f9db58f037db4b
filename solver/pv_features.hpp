#pragma once

#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace cohort {

/// Pressure and volume of a member.
struct PvSeries {
  std::span<const std::string> compartments;  ///< as pv_compartments() names them
  std::span<const float> pressure, volume;    ///< (compartments, samples) mmHg, mL
  double interval_ms;                         ///< between samples; the first one is at 0
  double
      beat_ms;  ///< NaN: no beats; the whole series is then taken for one, and what needs its length is NaN
  /// From which the left ventricle fills where there is no atrium; NaN: not known.
  double filling_mmHg = std::numeric_limits<double>::quiet_NaN();
};

/// Names and units of what pv_features() measures, in its order: of a ventricle with its artery volumes,
/// pressures, slopes of pressure, phases and stroke work; of an atrium, an artery and any other cavity the
/// extremes and means; the cardiac output.
std::vector<std::pair<std::string, std::string>> pv_feature_names(std::span<const std::string> compartments);

/// Measures the last beat of the series; the definitions are in solver/README.md. What is not there is NaN:
/// all of it where the series is shorter than a beat or a number of it is NaN; volumes and phases of a
/// ventricle that does not eject; what needs a closed loop where the beat does not end as it began.
std::vector<float> pv_features(const PvSeries& series);

}  // namespace cohort
