#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ensemble/work_precision_runs.hpp"

namespace cohort {

/// The steps in which one setting is coarser than another, all by one factor.
struct Coarsening {
  std::vector<std::string> paths;
  double factor = 1;
};
/// Nothing where something else differs, too.
std::optional<Coarsening> coarsening(const ResolvedSetting& coarse, const ResolvedSetting& fine);

/// Order seen between two settings that differ in one spacing or step alone, or in several by one factor.
struct ObservedOrder {
  std::string path;          ///< of several: "grid.dx_mm, mechanics.dx_mm"
  std::size_t coarse, fine;  ///< settings
  double coarse_h, fine_h;   ///< of the first path
  std::size_t measure;
  double order;
};

/// p with e_coarse / e_fine = (h_coarse^p - r^p) / (h_fine^p - r^p): errors against a run of step r (0: the
/// truth) are those of the coarse step less its own. NaN where no p in (0, 8) fits.
double observed_order(double coarse_error, double fine_error, double coarse_h, double fine_h,
                      double reference_h);

/// Between each setting and the next finer of those that differ from it in the same steps, all resolved: a
/// step that a setting or the reference does not name is the scene's. Left out where a step is the plan's
/// choice (0), where the reference is no finer, and where it is finer by another factor in each of several
/// steps: no single r fits. `reference`: null where it is values.
std::vector<ObservedOrder> observed_orders(const std::vector<SettingRun>& runs, const SettingRun* reference,
                                           const std::vector<MeasureErrors>& errors);

/// Of a setting in single precision and its twin in double: how far apart they are by a measure, rms over the
/// members, and that over the error of the single one.
struct RoundingShare {
  std::size_t single, twin, measure;
  double apart, share;
};
std::vector<RoundingShare> rounding_shares(const std::vector<SettingRun>& runs,
                                           const std::vector<MeasureErrors>& errors);

}  // namespace cohort
