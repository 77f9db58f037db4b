#pragma once

#include <string>
#include <vector>

#include "ensemble/claims.hpp"
#include "ensemble/error_model.hpp"
#include "ensemble/schema.hpp"
#include "ensemble/store.hpp"

namespace cohort {

/// What the checks tell of one feature, over the members for which both runs are done and have it.
struct FeatureError {
  std::string feature, unit;
  int checks = 0;
  double mean = 0, rms = 0, largest = 0;  ///< of the errors; the largest is of their size
  double left_out_rms = 0, left_out_rms_constant = 0;
  ErrorModelKind model = ErrorModelKind::none;
};

/// Writes /members/error_estimate, /members/error_measured and /errors from the rows of members and checks,
/// if they are not there yet as these rows have it: signed errors, as measured for members that were checked,
/// by the model of their feature for the others; NaN for members that are not done and features that they do
/// not have. Does nothing where a member or check has not ended, or the campaign has no checks. The bytes are
/// a function of the rows: whichever process comes last writes the same, and a kill meanwhile leaves
/// /errors/state 0, which the next run mends. Throws std::runtime_error where the file cannot be written.
void write_errors(Store& store, const Schema& schema, Claims& claims);

/// Takes back what write_errors wrote: some row is to be run again.
void forget_errors(Store& store);

/// Whether the errors have been written.
bool has_errors(const Store& store);
/// Whether they are what was written: recomputes their checksum. True where there are none.
bool errors_are_intact(const Store& store);

/// One entry for each feature. Only where has_errors.
std::vector<FeatureError> feature_errors(const Store& store);
/// These as a table: feature, unit, checks, mean, rms, largest, left out, model; a line for those without
/// any.
std::string error_table(const Store& store);

}  // namespace cohort
