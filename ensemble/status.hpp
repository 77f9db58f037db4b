#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ensemble/store.hpp"

namespace cohort {

/// Exit code of a run by what the status column says: 0 all done, 2 all ended but some failed, 3 some have
/// not ended.
int exit_code(const std::vector<Status>& statuses);
/// The same of a campaign: 3 too where a check has not ended. A check that failed leaves the members' code.
int exit_code(const Store& store);

/// Members done per hour, from the times of the last of them (64 at most); none before two batches are done.
/// What failed or was rejected is no heart.
std::optional<double> hearts_per_hour(const Store& store);

/// What `cohort status` prints: counts by status, hearts per hour, time to the end, reasons of failure with
/// their members; the same of the checks; the errors of the features once they are known.
std::string status_report(const Store& store);

/// `cohort status F.h5 [--watch]`: prints the report once, or every two seconds until all members have ended
/// or SIGINT. Returns 0, or 1 where the file is no store.
int status_command(const std::filesystem::path& path, bool watch);

/// `cohort verify F.h5`: recomputes the checksum of every row that has ended, checks too; a bad row goes back
/// to the queue. Errors that are not what was written, or of rows that go back, are written again by the next
/// run. Returns 0 where all are intact, 3 where some went back (the campaign can be resumed), 1 where the
/// file is no store.
int verify_command(const std::filesystem::path& path);

}  // namespace cohort
