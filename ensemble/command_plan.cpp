#include <spdlog/fmt/fmt.h>

#include <cstdio>

#include "ensemble/choose_checks.hpp"
#include "ensemble/choose_device.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "ensemble/plan_campaign.hpp"
#include "ensemble/run_checks.hpp"
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

/// What the checks take, from a plan of theirs; empty without any.
std::string check_line(Device& device, const Campaign& campaign, const Samples& samples,
                       std::span<const Member> all, double members_s) {
  const auto checked = choose_checks(samples, campaign.members, check_count(campaign));
  if (checked.empty() || layout(campaign.scene).features.empty()) return {};
  const std::string count = fmt::format("{} member{} again at half the spacing and the step", checked.size(),
                                        checked.size() == 1 ? "" : "s");
  const FineCampaign fine = fine_campaign(campaign.scene, all);
  PlanOptions options = plan_options(campaign);
  options.members_per_device = 0;
  try {
    const Plan plan = make_plan(device, fine.scene, fine.members, options);
    const double seconds = plan.seconds_per_member * static_cast<double>(checked.size());
    return fmt::format("{}, {} each: {} ({:.0f} % more), {}", count, human_seconds(plan.seconds_per_member),
                       human_seconds(seconds), 100 * seconds / members_s, human_bytes(plan.bytes));
  } catch (const std::exception& error) {
    return fmt::format("{}: will fail, {}", count, error.what());
  }
}

std::string size_table(const Plan& plan, const Campaign& campaign, const DeviceInfo& device,
                       const std::string& checks) {
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
  if (!checks.empty()) sizes.add({"checks", checks});
  sizes.add({"sampled", fmt::format("{} of {} parameters", sample(campaign).paths.size(), table.size())});
  return sizes.text();
}

}  // namespace

ExitCode command_plan(const CampaignOptions& options) {
  const Campaign campaign = read_campaign(options.file, options.overrides);
  share_cores({});
  Device device(choose_device(options.device, {}));
  Plan plan;
  const Samples samples = sample(campaign);
  const std::vector<Member> all = members(campaign, samples);
  told_in_place(campaign, [&] { plan = plan_campaign(device, campaign, all); });
  const std::string checks = check_line(device, campaign, samples, all,
                                        plan.seconds_per_member * static_cast<double>(campaign.members));
  fmt::print("{}\n{}\n", module_table(plan), size_table(plan, campaign, device.info(), checks));
  for (const std::string& line : campaign.accuracy_lines) fmt::print("{}\n", line);
  for (const std::string& line : conduction_lines(plan)) fmt::print("{}\n", line);
  return ExitCode::done;
}

}  // namespace cohort
