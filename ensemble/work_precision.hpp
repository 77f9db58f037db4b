#pragma once

#include "ensemble/commands.hpp"
#include "ensemble/study.hpp"

namespace cohort {

ExitCode run_work_precision(Study& study, const CampaignOptions& options);

}  // namespace cohort
