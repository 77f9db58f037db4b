#pragma once

#include <span>
#include <string>
#include <vector>

#include "ensemble/campaign.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// The limits of a campaign.
PlanOptions plan_options(const Campaign& campaign);

/// The plan of a campaign within its own limits (members_per_device, memory_limit_GB). Throws as make_plan.
Plan plan_campaign(Device& device, const Campaign& campaign, std::span<const Member> members);

/// Activation method with its reason, and the conduction velocity of every region; a line each.
std::vector<std::string> conduction_lines(const Plan& plan);

}  // namespace cohort
