#pragma once

#include "ensemble/commands.hpp"
#include "ensemble/study.hpp"

namespace cohort {

ExitCode run_stability(Study& study, const CampaignOptions& options);

}  // namespace cohort
