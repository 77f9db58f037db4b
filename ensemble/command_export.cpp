#include <spdlog/spdlog.h>

#include <stdexcept>

#include "ensemble/choose_device.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/exports.hpp"
#include "ensemble/members.hpp"

namespace cohort {

namespace {

void check_kinds(const std::vector<std::string>& kinds) {
  for (const std::string& kind : kinds)
    if (kind != "vtk")
      throw std::runtime_error(fmt::format("--export {}: unknown; vtk writes the fields of a member", kind));
}

}  // namespace

ExitCode command_export(const CampaignOptions& options) {
  check_kinds(options.exports);
  Campaign campaign = read_campaign(options.file, options.overrides);
  if (!options.store.empty()) campaign.store = options.store;
  if (options.export_member < 0 || options.export_member >= campaign.members)
    throw std::runtime_error(
        fmt::format("--member {}: there are members 0 to {}", options.export_member, campaign.members - 1));
  // Activation is looked at whether or not the campaign records it.
  if (!campaign.scene.activation) campaign.scene.activation.emplace();
  const Member member = members(campaign)[static_cast<std::size_t>(options.export_member)];

  share_cores({});
  Device device(choose_device(options.device, {}));
  PlanOptions plan_options;
  plan_options.members_per_device = 1;
  const Plan plan = make_plan(device, campaign.scene, {&member, 1}, plan_options);
  for (const std::string& kind : options.exports)
    if (kind == "vtk") export_vtk({campaign, member, device, plan}, options.export_every_ms);
  return ExitCode::done;
}

}  // namespace cohort
