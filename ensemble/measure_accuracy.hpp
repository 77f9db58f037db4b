#pragma once

#include <vector>

#include "ensemble/measurements.hpp"
#include "ensemble/work_precision_store.hpp"

namespace cohort {

/// What a study of one scene has measured of its features, for `accuracy:`.
///
/// A bound is |mean| + k s of the signed errors over the members, not below the largest seen, over 1 - r. k
/// is the two-sided tolerance factor: where errors are normally distributed, 95 % of such members lie within
/// it in 90 % of studies or more. Errors with longer tails are covered less often: exponential ones in 69,
/// 68 and 72 % of studies of 8, 12 and 20 members, log-normal ones (sigma 1) in 58, 58 and 66 %.
///
/// r is the largest ratio of a length, step or tolerance of the reference to that of the setting (an error of
/// first order, as if both had it: the reference is that much nearer to the truth than it seems). All count
/// that differ between any two of the settings and the reference, each by itself and with the defaults filled
/// in. What is the same in all of them is not measured: its error is not in the bounds (torso.dx_mm, say).
/// A setting that is not finer in the reference in all that count, or is the reference, has no known bound; a
/// step that is chosen (0) is no number to compare. Settings that did not end are left out.
Measurements measurements_of(const Study& study, const WorkPrecision& result);

/// The bound of signed errors with the tolerance factor of their number and the ratio r; infinite where it is
/// not known.
double error_bound(const std::vector<double>& errors, double factor, double ratio);

/// Throws ConfigError where `accuracy:` could not use what the study measures: too few members, or settings
/// that are no settings of numerics.
void check_measurable(Study& study, const WorkPrecisionDesign& design);

}  // namespace cohort
