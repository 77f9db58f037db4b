#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ensemble/work_precision_design.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// What one setting gave and took, N members.
struct SettingRun {
  std::vector<Recording> recordings;  ///< (N) of the first run
  Layout layout;
  ResolvedSetting resolved;
  std::vector<double>
      device_s;                ///< a repeat each: of all kernels on the device, every launch timed, a member
  std::vector<double> wall_s;  ///< a repeat each: of the host's clock, a member, kernels compiled by then
  double roof_s = 0;           ///< least traffic of all kernels at the device's triad, a member
  std::string outcome;         ///< empty where all members are done, else the first one's that is not

  double median_device_s() const;
};

/// NaN of no values.
double median(std::vector<double> values);

/// Runs the reference once and every setting `repeats` times, in turns: a machine that drifts harms none.
/// `runs` takes the place of the settings, `reference` that of the reference where there is one. False where
/// it was interrupted: repeats may then be fewer, and runs without any.
bool run_settings(Device& device, const Study& study, const WorkPrecisionDesign& design,
                  SettingRun& reference, std::vector<SettingRun>& runs);

/// Errors by one measure.
struct MeasureErrors {
  std::string name, unit;
  std::vector<std::vector<double>> of;  ///< (R, N); signed for features; NaN where a member is not done
  std::vector<double> reference;        ///< (N) the feature's value in the reference; NaN for norms

  double rms(std::size_t setting) const;
  double largest(std::size_t setting) const;
};

/// Whether a measure is a norm of what is recorded, and no feature.
bool is_norm(const std::string& measure);

/// The whole name of a measure in a scene, or nothing where the scene does not give it.
std::optional<std::string> measure_name(const std::string& measure, const Layout& layout);

/// Errors of all runs by every measure, against `reference` or, for what it names, `known`. Series are
/// compared by the root mean square of the difference over that of the reference, in %; `activation` is the
/// mean absolute difference of all activation times, ms. Throws std::runtime_error for a measure that the
/// scene does not have.
std::vector<MeasureErrors> measure_errors(const std::vector<std::string>& measures,
                                          const std::vector<SettingRun>& runs, const SettingRun* reference,
                                          const std::map<std::string, double>& known);

/// Seconds of a setting: median, least and most of its repeats.
struct Seconds {
  double median, least, most;
};

/// By how much a setting misses the front of time and error.
struct FrontDistance {
  /// 1: on the front. Else the smallest factor by which both its time and its error had to shrink so that no
  /// other setting is better in both: over all others, the smaller of the factors in time and in error, of
  /// which the largest (the multiplicative epsilon indicator). Errors within 1e-3 are equal, and times within
  /// the larger of both settings' spreads of repeats: then the other factor counts alone.
  double factor;
  double slower;  ///< time over that of the fastest of no larger error
  double worse;   ///< error over that of the best in no more time
};

/// All NaN for a setting whose error is no number.
FrontDistance distance_to_front(const std::vector<Seconds>& time, const std::vector<double>& error,
                                std::size_t i);

}  // namespace cohort
