#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ensemble/store.hpp"

namespace cohort {

/// What a row says of itself, as it stands in the file.
struct StoredRow {
  std::vector<float> ecg, pressure, volume, displacement;  ///< as in Recording
  std::vector<float> features;
  double dt_ms = 0;
};

/// The first check that a row which is done fails, with its numbers; empty where it passes all. The bounds
/// and what they mean stand in solver/README.md.
std::string failed_check(const Layout& layout, const StoredRow& row);

/// How one member of a study ended.
struct StabilityOutcome {
  Status status = Status::empty;
  std::string cause;   ///< "done", "check failed: ..." or "unstable: ..." with numbers masked
  std::string reason;  ///< with its numbers; empty where done
  double at_ms = 0;    ///< NaN where done
  bool good() const { return status == Status::done && reason.empty(); }
};

/// Reads every row that has ended, checks those that are done and writes what each came to into
/// /study/outcome. Throws std::runtime_error where the file cannot be read or written.
std::vector<StabilityOutcome> stability_outcomes(Store& store, const Layout& layout);

/// The members of one case.
struct StabilityResult {
  std::string name;  ///< of the case, as the tables show it
  StudyMembers members;
  std::vector<StabilityOutcome> outcomes;
};

struct StabilityVerdict {
  std::int64_t members = 0, inside = 0, inside_done = 0;
  std::int64_t done = 0, check_failed = 0;
  std::int64_t hung = 0, crashed = 0, unnamed = 0;  ///< timeout, failed, without a reason
  /// Nothing hung, crashed or failed a check, every end has a cause, and `share` of the members inside are
  /// done.
  bool good(double share) const;
  std::string text(double share) const;  ///< one line
};
StabilityVerdict verdict(const std::vector<StabilityResult>& results);

/// Two tables: members by group and outcome, then each cause with its count, first member, time and reason.
std::string stability_report(const std::vector<StabilityResult>& results);

/// A line for each case, group and cause, separated by commas.
std::string stability_csv(const std::vector<StabilityResult>& results);

}  // namespace cohort
