#pragma once

#include "ensemble/commands.hpp"
#include "ensemble/study.hpp"

namespace cohort {

/// A study of kind stability: runs the members of its design, case after case, as `cohort run` runs a
/// campaign (ranks, claims, resume), then reads every row again, checks what is done and names what is not.
/// Prints the tables and writes them as <store>.csv; /study in each store holds the group of a member,
/// whether it lies inside the documented ranges, and its outcome. ExitCode::failed where the outcome does not
/// hold (StabilityVerdict).
ExitCode run_stability(Study& study, const CampaignOptions& options);

}  // namespace cohort
