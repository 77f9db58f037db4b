#pragma once

#include <string>
#include <vector>

#include "ensemble/work_precision_orders.hpp"

namespace cohort {

/// A finished study of kind work_precision: R settings, M measures, N members.
struct WorkPrecision {
  std::string scene;  ///< name of what for_each sets; empty where there is one scene
  WorkPrecisionDesign design;
  std::vector<SettingRun> runs;       ///< (R)
  SettingRun reference;               ///< empty where the reference is values
  std::vector<MeasureErrors> errors;  ///< (M)
  std::vector<ObservedOrder> orders;
  std::vector<RoundingShare> rounding;
  std::string device;
  double triad_GB_per_s = 0;
  bool whole = true;     ///< false where it was interrupted: what had not run is left out
  bool has_rows = true;  ///< every setting has run, if not as often as it should have

  std::vector<Seconds> times() const;                               ///< (R) of the device, for a member
  std::vector<double> rms(std::size_t measure) const;               ///< (R)
  std::vector<FrontDistance> distances(std::size_t measure) const;  ///< (R)
  std::size_t default_setting() const;                              ///< R where it has not run
};

/// Writes the HDF5 file; analysis/study.py names what is in it. Throws std::runtime_error.
void write_study(const std::string& path, const Study& study, const std::vector<WorkPrecision>& scenes);

/// A row for each setting and measure.
std::string study_csv(const std::vector<WorkPrecision>& scenes);

/// What is printed: for each measure the settings from the fastest to the slowest with the front marked, then
/// observed orders and shares of rounding.
std::string study_report(const WorkPrecision& result);

}  // namespace cohort
