#include "ensemble/work_precision_runs.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "ensemble/interrupt.hpp"
#include "ensemble/members.hpp"
#include "ensemble/plan_campaign.hpp"
#include "ensemble/table.hpp"

namespace cohort {

namespace {

/// A setting ready to run.
struct Prepared {
  Campaign campaign;
  std::vector<Member> members;
  Plan plan;
};

/// Settings of a study are coarse on purpose: what warns of that is told with --verbose alone.
class QuietWarnings {
 public:
  QuietWarnings() : level_(spdlog::get_level()) {
    if (level_ > spdlog::level::debug) spdlog::set_level(spdlog::level::err);
  }
  ~QuietWarnings() { spdlog::set_level(level_); }
  QuietWarnings(const QuietWarnings&) = delete;
  QuietWarnings& operator=(const QuietWarnings&) = delete;

 private:
  spdlog::level::level_enum level_;
};

Prepared prepare(Device& device, const Study& study, const Setting& setting) {
  const QuietWarnings quiet;
  Prepared result;
  result.campaign = campaign_of(study, setting.overrides(), study.file);
  result.members = members(result.campaign);
  result.plan = plan_campaign(device, result.campaign, result.members);
  return result;
}

std::string outcome_of(const std::vector<Recording>& recordings) {
  for (std::size_t m = 0; m < recordings.size(); ++m)
    if (recordings[m].outcome != Outcome::done) return fmt::format("member {}: {}", m, recordings[m].reason);
  return {};
}

void run_once(Device& device, const Prepared& prepared, SettingRun& run) {
  const QuietWarnings quiet;
  Simulation simulation(device, prepared.campaign.scene, prepared.plan);
  simulation.time_every_launch(true);
  std::vector<Recording> recordings;
  const auto batch = static_cast<std::size_t>(prepared.plan.members_per_device);
  double wall_s = 0;
  for (std::size_t first = 0; first < prepared.members.size(); first += batch) {
    const std::size_t count = std::min(batch, prepared.members.size() - first);
    for (Recording& recording : simulation.run(std::span(prepared.members).subspan(first, count),
                                               prepared.campaign.timeout_s * static_cast<double>(count))) {
      wall_s += recording.wall_s;
      recordings.push_back(std::move(recording));
    }
  }
  simulation.time_every_launch(false);
  double device_ms = 0, bytes = 0;
  for (const KernelPerformance& kernel : simulation.performance()) {
    device_ms += kernel.device_ms;
    bytes += kernel.bytes_per_call * static_cast<double>(kernel.calls);
  }
  const auto members = static_cast<double>(prepared.members.size());
  run.device_s.push_back(device_ms * 1e-3 / members);
  run.wall_s.push_back(wall_s / members);
  run.roof_s = bytes * 1e-9 / device.triad_GB_per_s() / members;
  if (!run.recordings.empty()) return;
  run.recordings = std::move(recordings);
  run.layout = layout(prepared.campaign.scene);
  run.resolved = resolved(prepared.campaign);
  run.outcome = outcome_of(run.recordings);
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

double SettingRun::median_device_s() const {
  return median(device_s);
}

bool run_settings(Device& device, const Study& study, const WorkPrecisionDesign& design,
                  SettingRun& reference, std::vector<SettingRun>& runs) {
  const auto tell = [](const std::string& label, const SettingRun& run) {
    spdlog::info("{}: {} of the device, {} in all, a member{}", label, human_seconds(run.device_s.back()),
                 human_seconds(run.wall_s.back()), run.outcome.empty() ? "" : "; " + run.outcome);
  };
  if (design.reference) {
    run_once(device, prepare(device, study, *design.reference), reference);
    tell("reference", reference);
    if (!reference.outcome.empty())
      throw std::runtime_error("the reference is not done: " + reference.outcome);
  }
  std::vector<std::optional<Prepared>> prepared(design.settings.size());
  runs.assign(design.settings.size(), {});
  for (int repeat = 0; repeat < design.repeats; ++repeat)
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (interrupts() > 0) return false;
      if (!runs[i].outcome.empty()) continue;  // it would not be done the next time
      if (!prepared[i]) prepared[i] = prepare(device, study, design.settings[i]);
      run_once(device, *prepared[i], runs[i]);
      tell(fmt::format("{} ({} of {})", design.settings[i].label, repeat + 1, design.repeats), runs[i]);
    }
  return true;
}

}  // namespace cohort
