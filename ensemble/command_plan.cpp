#include <spdlog/fmt/fmt.h>

#include <cstdio>

#include "ensemble/choose_device.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "ensemble/plan_campaign.hpp"
#include "ensemble/table.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

namespace {

std::string module_table(const Plan& plan) {
  TextTable table({Align::left, Align::left, Align::right, Align::left, Align::left});
  table.add({"module", "runs", "memory", "why", "kernels"});
  for (const PlannedModule& module : plan.modules)
    table.add({module.name, module.runs ? "yes" : "left out", module.runs ? human_bytes(module.bytes) : "-",
               module.reason, fmt::format("{}", fmt::join(module.kernels, " "))});
  return table.text();
}

std::string size_table(const Plan& plan, const Campaign& campaign, const DeviceInfo& device) {
  const ParameterTable& table = campaign.scene.parameters;
  const auto setting = [&](const char* path) { return table[table.index(path)].value; };
  TextTable sizes({Align::left, Align::left});
  sizes.add({"device",
             fmt::format("{} ({}), {}", device.name, device.unique_id, human_bytes(device.memory_bytes))});
  if (plan.tissue_cells > 0) {
    sizes.add({"grid", fmt::format("{} x {} x {} cells of {} mm", plan.cells[0], plan.cells[1], plan.cells[2],
                                   setting("grid.dx_mm"))});
    sizes.add({"tissue", fmt::format("{} cells in {} segments", plan.tissue_cells, plan.segments)});
  }
  sizes.add({"time", campaign.scene.beats
                         ? fmt::format("{} steps of {} ms at most, of which the last {} ms are recorded",
                                       plan.steps, plan.dt_ms, recorded_ms(campaign.scene))
                         : fmt::format("{} steps of {} ms to {} ms", plan.steps, plan.dt_ms,
                                       recorded_ms(campaign.scene))});
  sizes.add({"memory", fmt::format("{} for {} member{} at a time", human_bytes(plan.bytes),
                                   plan.members_per_device, plan.members_per_device == 1 ? "" : "s")});
  sizes.add({"one member", human_seconds(plan.seconds_per_member)});
  sizes.add({"campaign",
             fmt::format("{} member{}, {} on this device", campaign.members, campaign.members == 1 ? "" : "s",
                         human_seconds(plan.seconds_per_member * static_cast<double>(campaign.members)))});
  sizes.add({"sampled", fmt::format("{} of {} parameters", sample(campaign).paths.size(), table.size())});
  return sizes.text();
}

}  // namespace

ExitCode command_plan(const CampaignOptions& options) {
  const Campaign campaign = read_campaign(options.file, options.overrides);
  share_cores({});
  Device device(choose_device(options.device, {}));
  Plan plan;
  told_in_place(campaign, [&] { plan = plan_campaign(device, campaign, members(campaign)); });
  fmt::print("{}\n{}\n", module_table(plan), size_table(plan, campaign, device.info()));
  for (const std::string& line : campaign.accuracy_lines) fmt::print("{}\n", line);
  for (const std::string& line : conduction_lines(plan)) fmt::print("{}\n", line);
  return ExitCode::done;
}

}  // namespace cohort
