#include "ensemble/plan_campaign.hpp"

#include <spdlog/fmt/fmt.h>

namespace cohort {

std::vector<std::string> conduction_lines(const Plan& plan) {
  if (plan.activation_reason.empty()) return {};  // no tissue
  std::vector<std::string> lines = {
      fmt::format("activation by {}: {}", method_name(plan.activation), plan.activation_reason)};
  for (const PlannedConduction& front : plan.conduction) {
    if (front.along_mm_per_ms > 0 && front.width_along_mm == 0)  // as set; no cable was run
      lines.push_back(fmt::format("conduction velocity {}: {:.3f} mm/ms along fibres, {:.3f} across",
                                  front.region, front.along_mm_per_ms, front.across_mm_per_ms));
    else if (front.along_mm_per_ms > 0)
      lines.push_back(
          fmt::format("conduction velocity {}: {:.3f} mm/ms along fibres, {:.3f} across; front {:.2f} mm "
                      "wide, {:.2f} across",
                      front.region, front.along_mm_per_ms, front.across_mm_per_ms, front.width_along_mm,
                      front.width_across_mm));
    else
      lines.push_back(fmt::format("conduction velocity {}: conducts no plane front", front.region));
  }
  return lines;
}

PlanOptions plan_options(const Campaign& campaign) {
  constexpr double bytes_per_GB = 1e9;
  PlanOptions options;
  options.members_per_device = campaign.members_per_device;
  options.memory_limit_bytes = static_cast<std::size_t>(campaign.memory_limit_GB * bytes_per_GB);
  return options;
}

Plan plan_campaign(Device& device, const Campaign& campaign, std::span<const Member> members) {
  return make_plan(device, campaign.scene, members, plan_options(campaign));
}

}  // namespace cohort
