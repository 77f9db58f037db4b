#pragma once

#include "ensemble/commands.hpp"
#include "ensemble/study.hpp"

namespace cohort {

/// Runs a study of kind work_precision and writes its HDF5 file, the CSV and the picture beside it. One rank.
/// Throws ConfigError for mistakes in the file.
ExitCode run_work_precision(Study& study, const CampaignOptions& options);

}  // namespace cohort
