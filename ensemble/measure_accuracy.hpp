#pragma once

#include <vector>

#include "ensemble/measurements.hpp"
#include "ensemble/work_precision_store.hpp"

namespace cohort {

/// What a study of one scene has measured of its features, for `accuracy:`.
///
/// A bound is |mean| + k s of the signed errors over the members, not below the largest seen, times the
/// shortfall below. k is the two-sided tolerance factor: where errors are normally distributed, 95 % of such
/// members lie within it in 90 % of studies or more. Errors with longer tails are covered less often:
/// exponential ones in 69, 68 and 72 % of studies of 8, 12 and 20 members, log-normal ones (sigma 1) in 58,
/// 58 and 66 %.
///
/// The largest shortfall counts, over all lengths, steps and tolerances that differ between any two of the
/// settings and the reference, with the defaults filled in. Pairs of settings that differ in one length or
/// step alone, by a factor of 2 or more, tell a feature's order in it: the least that one of them shows, from
/// 1 to 2, and 1 without a pair. Where all pairs have the same errors to a thousandth, it has no part in the
/// feature and does not count. What is the same in all settings and the reference is not measured: its error
/// is not in the bounds (torso.dx_mm, say). A setting that is not finer in the reference in all that count,
/// or is the reference, has no known bound; a step that is left open (0) is the one that was chosen. Settings
/// that did not end are left out.
Measurements measurements_of(const Study& study, const WorkPrecision& result);

/// What an error against a reference is to be multiplied by, as the reference errs the same way: at `ratio`
/// of the setting's step. 1 / (1 - ratio) by first order, or with q = ratio^order 1 + 2 q / (1 - q) where
/// that is less; of sums a h + b h^2, a and b of one sign, whose order is seen by steps of factor 2 to 4,
/// this is at most 1 % too little (with 1.25 instead of 2, as of P. J. Roache's grid convergence index, J.
/// Fluids Eng. 116 (1994) 405, by up to 6 %). Terms of different signs may cancel: then it can be. Infinite
/// where the ratio is not below 1.
double shortfall(double ratio, double order);

/// The bound of signed errors with the tolerance factor of their number and the shortfall; infinite where it
/// is not known.
double error_bound(const std::vector<double>& errors, double factor, double short_by);

/// Throws ConfigError where `accuracy:` could not use what the study measures: too few members, or settings
/// that are no settings of numerics.
void check_measurable(Study& study, const WorkPrecisionDesign& design);

}  // namespace cohort
