#include "ensemble/plan_campaign.hpp"

namespace cohort {

Plan plan_campaign(Device& device, const Campaign& campaign, std::span<const Member> members) {
  constexpr double bytes_per_GB = 1e9;
  PlanOptions options;
  options.members_per_device = campaign.members_per_device;
  options.memory_limit_bytes = static_cast<std::size_t>(campaign.memory_limit_GB * bytes_per_GB);
  return make_plan(device, campaign.scene, members, options);
}

}  // namespace cohort
