#pragma once

#include "ensemble/measurements.hpp"
#include "ensemble/work_precision_store.hpp"

namespace cohort {

/// What a study of one scene has measured of its features, for `accuracy:`. A bound is that of a share of 95
/// % with a confidence of 90 % (tolerance_factor), not below the largest seen, over 1 - r, where r is the
/// largest ratio of the reference's step to the setting's (an error of first order, as if both had it: the
/// reference is that much nearer to the truth than it seems). Of a setting no coarser than the reference in
/// some step no bound is known. Settings that did not end are left out.
Measurements measurements_of(const Study& study, const WorkPrecision& result);

}  // namespace cohort
