#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>

#include "ensemble/choose_checks.hpp"
#include "ensemble/choose_device.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "ensemble/plan_campaign.hpp"
#include "ensemble/run_checks.hpp"
#include "ensemble/table.hpp"
#include "solver/circulation.hpp"
#include "solver/pv_output.hpp"
#include "solver/trial.hpp"

namespace cohort {

namespace {

// Kernels that the trial launched, by module.
std::map<std::string, std::vector<std::string>> kernels_of_modules(const Trial& trial, const Plan& plan) {
  std::map<std::string, std::vector<std::string>> result;
  const auto runs = [&](const std::string& name) {
    return std::any_of(plan.modules.begin(), plan.modules.end(),
                       [&](const PlannedModule& module) { return module.name == name && module.runs; });
  };
  for (const Footprint::Kernel& kernel : trial.footprint.kernels) {
    if (kernel.launches == 0) continue;
    std::string module = module_of(kernel.file);
    // Those of the elliptic solver are its user's.
    if (module.empty()) module = runs("torso") ? "torso" : "bidomain";
    if (!runs(module) && runs("tension drive")) module = "tension drive";  // the columns of its cells
    std::vector<std::string>& names = result[module];
    if (std::find(names.begin(), names.end(), kernel.name) == names.end()) names.push_back(kernel.name);
  }
  return result;
}

std::string module_table(const Plan& plan, const Trial& trial) {
  auto kernels = kernels_of_modules(trial, plan);
  TextTable table({Align::left, Align::left, Align::right, Align::left, Align::left});
  table.add({"module", "runs", "memory", "why", "kernels"});
  for (const PlannedModule& module : plan.modules)
    table.add({module.name, module.runs ? "yes" : "left out", module.runs ? human_bytes(module.bytes) : "-",
               module.reason, fmt::format("{}", fmt::join(kernels[module.name], " "))});
  return table.text();
}

/// What the checks take, from a plan of theirs; empty without any.
std::string check_line(Device& device, const Campaign& campaign, const Samples& samples,
                       std::span<const Member> all, ActivationMethod activation, double members_s) {
  const auto checked = choose_checks(samples, campaign.members, check_count(campaign));
  if (checked.empty() || layout(campaign.scene).features.empty()) return {};
  const std::string count = fmt::format("{} member{} again at half the spacing and the step", checked.size(),
                                        checked.size() == 1 ? "" : "s");
  const FineCampaign fine = fine_campaign(campaign.scene, all, activation);
  PlanOptions options = plan_options(campaign);
  options.members_per_device = 0;
  try {
    const Plan plan = make_plan(device, fine.scene, fine.members, options);
    const double each_s = try_out(device, fine.scene, plan, fine.members).seconds_per_member;
    const double seconds = each_s * static_cast<double>(checked.size());
    return fmt::format("{}, {} each: {} ({:.0f} % more), {}", count, human_seconds(each_s),
                       human_seconds(seconds), 100 * seconds / members_s, human_bytes(plan.bytes));
  } catch (const std::exception& error) {
    return fmt::format("{}: will fail, {}", count, error.what());
  }
}

std::string largest_buffers(const Trial& trial) {
  constexpr std::size_t shown = 6;
  std::vector<std::string> texts;
  for (const Footprint::Buffer& buffer : trial.footprint.buffers) {
    if (texts.size() == shown) break;
    texts.push_back(fmt::format("{} of {} {}", buffer.name.empty() ? "others" : buffer.name, buffer.file,
                                human_bytes(buffer.bytes)));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::string kernel_line(const Trial& trial) {
  std::set<std::string> idle;
  std::size_t launched = 0;
  for (const Footprint::Kernel& kernel : trial.footprint.kernels)
    if (kernel.launches > 0)
      ++launched;
    else
      idle.insert(kernel.name);
  std::string text = fmt::format("{} launched, of {} programs", launched, trial.footprint.programs);
  if (trial.launches_per_step > 0) text += fmt::format("; {:.1f} launches a step", trial.launches_per_step);
  if (!idle.empty())
    text += fmt::format("; built with them, and not launched in the first steps: {}", fmt::join(idle, " "));
  return text;
}

// What the first steps told.
void add_trial(TextTable& sizes, const Plan& plan, const Trial& trial, const Campaign& campaign) {
  const Scene& scene = campaign.scene;
  if (trial.steps > 1) {
    const std::string dt = plan.dt_ms > 0 ? fmt::format(" of {:.4g} ms{}", plan.dt_ms,
                                                        scene.mechanics ? " at rest and less later" : "")
                                          : "";
    sizes.add({"time", scene.beats
                           ? fmt::format("{:.0f} steps{}, of which the last {} ms are recorded", trial.steps,
                                         dt, recorded_ms(scene))
                           : fmt::format("{:.0f} steps{} to {} ms", trial.steps, dt, recorded_ms(scene))});
  } else {
    sizes.add({"time", fmt::format("no steps of the host; {} ms are recorded", recorded_ms(scene))});
  }
  if (scene.beats)
    sizes.add({"beats", trial.beats_are_known
                            ? fmt::format("{:.3g}", trial.beats)
                            : fmt::format("{:.0f} expected; a member has 2 to {} until they agree, {} a beat",
                                          trial.beats, most_beats(scene),
                                          human_seconds(trial.steps * trial.step_s / trial.beats /
                                                        plan.members_per_device))});
  sizes.add({"largest buffers", largest_buffers(trial)});
  sizes.add({"kernels", kernel_line(trial)});
  sizes.add({"one member", fmt::format("{}, of which set-up {}", human_seconds(trial.seconds_per_member),
                                       human_seconds(trial.setup_s / plan.members_per_device))});
  sizes.add({"first batch",
             fmt::format("compiles and solves what all share, {} more", human_seconds(trial.first_batch_s))});
  sizes.add({"campaign",
             fmt::format("{} member{}, {} on this device", campaign.members, campaign.members == 1 ? "" : "s",
                         human_seconds(trial.seconds_per_member * static_cast<double>(campaign.members) +
                                       trial.first_batch_s))});
}

// trial: null where there was none; checks: what they take, or empty.
std::string size_table(const Plan& plan, const Trial* tried, const Campaign& campaign,
                       const DeviceInfo& device, const std::string& checks) {
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
  if (plan.dt_ms > 0 && !tried) sizes.add({"time", fmt::format("steps of {:.4g} ms", plan.dt_ms)});
  sizes.add({"memory", fmt::format("{} for {} member{} at a time", human_bytes(plan.bytes),
                                   plan.members_per_device, plan.members_per_device == 1 ? "" : "s")});
  if (tried) add_trial(sizes, plan, *tried, campaign);
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
  Trial trial;
  bool tried = false;
  const Samples samples = sample(campaign);
  const std::vector<Member> all = members(campaign, samples);
  std::string checks;
  told_in_place(campaign, [&] {
    plan = plan_campaign(device, campaign, all);
    if (options.quick) return;
    try {
      trial = try_out(device, campaign.scene, plan, all);
      tried = true;
    } catch (const std::runtime_error& error) {
      spdlog::warn("the first steps could not be run: {}", error.what());
    }
    checks = check_line(device, campaign, samples, all, plan.activation,
                        trial.seconds_per_member * static_cast<double>(campaign.members));
  });
  fmt::print("{}\n{}\n", module_table(plan, trial),
             size_table(plan, tried ? &trial : nullptr, campaign, device.info(), checks));
  for (const std::string& line : campaign.accuracy_lines) fmt::print("{}\n", line);
  for (const std::string& line : campaign.accuracy_warnings) spdlog::warn("{}", line);
  for (const std::string& line : conduction_lines(plan)) fmt::print("{}\n", line);
  return ExitCode::done;
}

}  // namespace cohort
