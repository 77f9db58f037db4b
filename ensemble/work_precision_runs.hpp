#pragma once

#include <map>
#include <string>
#include <vector>

#include "ensemble/work_precision_design.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// What one setting gave and took, N members.
struct SettingRun {
  std::vector<Recording> recordings;  ///< (N) of the first run
  Layout layout;
  std::vector<double>
      device_s;                ///< a repeat each: of all kernels on the device, every launch timed, a member
  std::vector<double> wall_s;  ///< a repeat each: of the host's clock, a member, kernels compiled by then
  double roof_s = 0;           ///< least traffic of all kernels at the device's triad, a member
  std::string outcome;         ///< empty where all members are done, else the first one's that is not

  double median_device_s() const;
};

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

/// Errors of all runs by every measure, against `reference` or, for what it names, `known`. Series are
/// compared by the root mean square of the difference over that of the reference, in %; `activation` is the
/// mean absolute difference of all activation times, ms. Throws std::runtime_error for a measure that the
/// scene does not have.
std::vector<MeasureErrors> measure_errors(const std::vector<std::string>& measures,
                                          const std::vector<SettingRun>& runs, const SettingRun* reference,
                                          const std::map<std::string, double>& known);

/// Members of the front: those to which no other setting is better in one of time and error and not worse in
/// the other. Settings with an error that is no number are not on it.
std::vector<bool> pareto_front(const std::vector<double>& time, const std::vector<double>& error);

/// By how much setting `i` misses the front: the least factor of time to a setting of no larger error, or of
/// error to a setting that takes no longer, whichever is smaller; 1 on the front.
double distance_to_front(const std::vector<double>& time, const std::vector<double>& error, std::size_t i);

/// Order seen between two settings that differ in one length or step alone.
struct ObservedOrder {
  std::string path;
  std::size_t coarse, fine;  ///< settings
  double coarse_h, fine_h;
  std::size_t measure;
  double order;
};

/// p with e_coarse / e_fine = (h_coarse^p - r^p) / (h_fine^p - r^p): errors against a run of step r (0: the
/// truth) are those of the coarse step less its own. NaN where no p in (0, 8) fits.
double observed_order(double coarse_error, double fine_error, double coarse_h, double fine_h,
                      double reference_h);

std::vector<ObservedOrder> observed_orders(const WorkPrecisionDesign& design,
                                           const std::vector<MeasureErrors>& errors);

/// Of a setting in single precision and its twin in double: how far apart they are by a measure, rms over the
/// members, and that over the error of the single one.
struct RoundingShare {
  std::size_t single, twin, measure;
  double apart, share;
};
std::vector<RoundingShare> rounding_shares(const WorkPrecisionDesign& design,
                                           const std::vector<SettingRun>& runs,
                                           const std::vector<MeasureErrors>& errors);

}  // namespace cohort
