#pragma once

#include "ensemble/campaign.hpp"
#include "ensemble/commands.hpp"

namespace cohort {

/// `cohort run FILE --export WHAT`: writes what each --export asks for of one member, and runs no campaign.
/// Throws std::runtime_error or ConfigError for what cannot be written.
ExitCode command_export(const CampaignOptions& options);

}  // namespace cohort
