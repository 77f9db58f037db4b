#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>

#include "ensemble/claims.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/error_estimate.hpp"
#include "ensemble/guarded.hpp"
#include "ensemble/interrupt.hpp"
#include "ensemble/performance_report.hpp"
#include "ensemble/plan_campaign.hpp"
#include "ensemble/progress.hpp"
#include "ensemble/ranks.hpp"
#include "ensemble/run_checks.hpp"
#include "ensemble/status.hpp"
#include "ensemble/table.hpp"
#include "ensemble/worker.hpp"

namespace cohort {

namespace {

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// Every rank parses the text that rank 0 has read, so that all run the same campaign whatever their file
/// systems show.
Campaign read_on_all(const Ranks& ranks, const CampaignOptions& options) {
  std::string text;
  ranks.agree([&] {
    if (ranks.first()) text = read_campaign_file(options.file);
  });
  text = ranks.broadcast(std::move(text));
  Campaign campaign;
  ranks.agree([&] { campaign = parse_campaign(text, options.file, options.overrides); });
  if (!options.store.empty()) campaign.store = options.store;
  return campaign;
}

/// Refuses the store of another campaign, and one in no folder, before any device is touched.
void require_own_store(const Ranks& ranks, const std::string& path, const Schema& schema) {
  ranks.agree([&] {
    if (!ranks.first()) return;
    const auto folder = std::filesystem::path(path).parent_path();
    if (!folder.empty() && !std::filesystem::exists(folder))
      throw std::runtime_error(
          fmt::format("{}: cannot be created: folder {} does not exist", path, folder.string()));
    if (std::filesystem::exists(path)) Store(path, Store::Access::write).require(schema);
  });
}

/// Creates the store if there is none and opens it on every rank.
std::unique_ptr<Store> open_store(const Ranks& ranks, const std::string& path, const Schema& schema,
                                  std::unique_ptr<Claims>& claims) {
  std::unique_ptr<Store> store;
  const auto open = [&] {
    claims = std::make_unique<Claims>(path);
    if (ranks.first()) {
      const bool created = create_store(path, schema, *claims);
      spdlog::info("{} {}", created ? "created" : "resuming", path);
    }
    store = std::make_unique<Store>(path, Store::Access::write);
    store->require(schema);
  };
  ranks.agree([&] {
    if (ranks.first()) open();
  });
  ranks.agree([&] {
    if (!ranks.first()) open();
  });
  return store;
}

/// Whether a lock of one rank is seen by all the others: between nodes that depends on the file system.
bool locks_work(const Ranks& ranks, Claims& claims) {
  if (!ranks.all(claims.work())) return false;
  if (ranks.size() == 1) return true;
  if (ranks.first()) claims.hold_probe(true);
  ranks.barrier();
  const bool seen = ranks.first() || claims.probe_is_held();
  const bool work = ranks.all(seen);
  if (ranks.first()) claims.hold_probe(false);
  return work;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

ProcessPerformance performance_of(const Simulation& simulation, Device& device, double wall_s) {
  ProcessPerformance performance;
  performance.kernels = simulation.performance();
  performance.device = device.info().name;
  performance.triad_GB_per_s = device.triad_GB_per_s();
  performance.simulated_ms = simulation.simulated_ms();
  performance.cell_updates = simulation.cell_updates();
  performance.wall_s = wall_s;
  return performance;
}

RunTotals add_up(const Ranks& ranks, const ProcessPerformance& performance, std::int64_t members) {
  RunTotals totals;
  totals.ranks = ranks.size();
  totals.members = ranks.sum(static_cast<double>(members));
  totals.simulated_ms = ranks.sum(performance.simulated_ms);
  totals.cell_updates = ranks.sum(performance.cell_updates);
  totals.wall_s = ranks.largest(performance.wall_s);
  return totals;
}

struct RunningCampaign {
  const Ranks& ranks;
  const Campaign& campaign;
  const Schema& schema;
  const std::vector<Member>& members;
  Device& device;
  std::optional<Simulation>& simulation;
  ActivationMethod activation;  ///< as planned
  Store& store;
  Claims& claims;
};

/// Returns how many members this rank has brought to their end in `done`. A member that is tried again, or
/// fails, is no heart.
std::int64_t simulate_members(const RunningCampaign& running, const WorkerOptions& options) {
  std::int64_t done = 0;
  std::optional<Progress> progress;
  if (running.ranks.first()) progress.emplace(running.campaign.store);
  const auto run = [&](std::span<const Member> batch, double timeout_s) {
    auto recordings = running.simulation->run(batch, timeout_s);
    done += std::count_if(recordings.begin(), recordings.end(),
                          [](const Recording& r) { return r.outcome == Outcome::done; });
    return recordings;
  };
  work(running.store, running.claims, running.schema.samples, running.members, run, options);
  return done;
}

bool have_ended(const Store& store) {
  return exit_code(store.statuses()) != static_cast<int>(ExitCode::interrupted);
}

/// What simulates checks on this rank: fine members, on the memory that the others have left. That it cannot
/// be had is how the checks end.
class FineSimulation {
 public:
  FineSimulation(const RunningCampaign& running, const FineCampaign& fine)
      : device_(running.device), scene_(fine.scene) {
    PlanOptions options = plan_options(running.campaign);
    options.members_per_device = 0;  // fewer fit than of the others
    try {
      plan_ = make_plan(device_, fine.scene, fine.members, options);
    } catch (const std::exception& error) {
      missing_ = error.what();
    }
  }

  bool is_possible() const { return missing_.empty(); }
  int members_per_device() const { return is_possible() ? plan_.members_per_device : 1; }

  std::vector<Recording> run(std::span<const Member> members, double timeout_s) {
    try {
      if (is_possible() && !simulation_) simulation_.emplace(device_, scene_, plan_);
    } catch (const std::exception& error) {
      missing_ = error.what();
    }
    if (!is_possible()) return without(members.size(), missing_);
    try {
      return simulation_->run(members, timeout_s);
    } catch (const std::exception& error) {
      if (members.size() > 1) throw;  // each is tried alone
      return without(1, fmt::format("device: {}", error.what()));
    }
  }

 private:
  static std::vector<Recording> without(std::size_t members, const std::string& why) {
    Recording failed;
    failed.reason = "at half the spacing and the step: " + why;
    return std::vector<Recording>(members, failed);
  }

  Device& device_;
  const Scene& scene_;
  Plan plan_;
  std::optional<Simulation> simulation_;
  std::string missing_;
};

/// Runs the checks once all members have ended. A rank whose device cannot hold them leaves them to those
/// whose can.
void run_checks(const RunningCampaign& running, WorkerOptions options) {
  const Ranks& ranks = running.ranks;
  Store checks(running.store.path(), Store::Access::write, checks_group);
  const bool open =
      have_ended(running.store) && has_open_checks(running.store, checks, running.schema, options.retries);
  if (ranks.all(!open)) return;
  running.simulation.reset();
  const FineCampaign fine = fine_campaign(running.campaign.scene, running.members, running.activation);
  FineSimulation simulation(running, fine);
  const bool possible_elsewhere = !ranks.all(!simulation.is_possible());
  if (!have_ended(running.store) || (possible_elsewhere && !simulation.is_possible())) return;

  std::optional<Progress> progress;
  if (ranks.first()) {
    spdlog::info("{} checks at half the spacing and the step, {} at a time", checks.members(),
                 simulation.members_per_device());
    progress.emplace(running.store.path(), std::chrono::seconds(30), checks_group);
  }
  options.members_per_device = simulation.members_per_device();
  Claims claims(running.store.path(), running.store.members());
  const auto run = [&](std::span<const Member> batch, double timeout_s) {
    return simulation.run(batch, timeout_s);
  };
  work_on_checks(running.store, checks, claims, running.schema, fine, run, options);
}

/// Members run from here on: what goes wrong leaves a campaign that can be resumed.
ExitCode run_members(const RunningCampaign& running, const WorkerOptions& options) {
  const Ranks& ranks = running.ranks;
  const auto begin = std::chrono::steady_clock::now();
  std::int64_t done = 0;
  ranks.agree([&] { done = simulate_members(running, options); });
  const auto performance = performance_of(*running.simulation, running.device, seconds_since(begin));
  ranks.agree([&] {
    const int slot = running.claims.claim_performance_slot(ranks.rank(), running.schema.performance_slots);
    if (slot >= 0) running.store.write_performance(slot, performance);
  });
  const RunTotals totals = add_up(ranks, performance, done);
  if (ranks.first() && totals.members > 0)
    fmt::print("{}{} of device memory at the peak\n", performance_report(performance, totals),
               human_bytes(running.device.peak_bytes()));
  if (running.store.has_checks()) {
    ranks.agree([&] { run_checks(running, options); });
    ranks.agree([&] {
      if (ranks.first()) write_errors(running.store, running.schema, running.claims);
    });
    if (ranks.first() && has_errors(running.store)) fmt::print("{}", error_table(running.store));
  }
  return static_cast<ExitCode>(exit_code(running.store));
}

}  // namespace

ExitCode command_run(const CampaignOptions& options) {
  const Ranks ranks;
  share_cores(ranks.local());
  return run_campaign(ranks, read_on_all(ranks, options), options.device);
}

ExitCode run_campaign(const Ranks& ranks, const Campaign& campaign, const std::string& device_name) {
  const Samples samples = sample(campaign);
  const std::vector<Member> all = members(campaign, samples);
  const Schema schema = make_schema(campaign, samples, layout(campaign.scene), COHORT_VERSION);
  require_own_store(ranks, campaign.store, schema);

  std::optional<Device> device;
  ranks.agree([&] { device.emplace(choose_device(device_name, ranks.local())); });
  spdlog::info("rank {} of {} on {}: {} ({})", ranks.rank(), ranks.size(), host_name(), device->info().name,
               device->info().unique_id);

  Plan plan;
  std::optional<Simulation> simulation;
  ranks.agree([&] {
    told_in_place(campaign, [&] {
      plan = plan_campaign(*device, campaign, all);
      device->restart_peak();
      simulation.emplace(*device, campaign.scene, plan);
    });
  });
  if (ranks.first()) {
    for (const std::string& line : campaign.accuracy_lines) spdlog::info("{}", line);
    for (const std::string& line : campaign.accuracy_warnings) spdlog::warn("{}", line);
    spdlog::info("{} members, {} tissue cells, {} steps of {} ms, {} at a time on each device",
                 campaign.members, plan.tissue_cells, plan.steps, plan.dt_ms, plan.members_per_device);
    for (const std::string& line : conduction_lines(plan)) spdlog::info("{}", line);
  }

  std::unique_ptr<Claims> claims;
  const std::unique_ptr<Store> store = open_store(ranks, campaign.store, schema, claims);
  WorkerOptions worker;
  worker.members_per_device = plan.members_per_device;
  worker.retries = campaign.retries;
  for (const char* path : {"time.step_factor", "mechanics.step_factor"})
    if (const int place = campaign.scene.parameters.find(path); place >= 0)
      worker.step_factors.push_back(static_cast<std::size_t>(place));
  worker.timeout_s = campaign.timeout_s;
  worker.rank = ranks.rank();
  worker.ranks = ranks.size();
  worker.device = device->info().name;
  worker.locks = locks_work(ranks, *claims);
  if (!worker.locks && ranks.first())
    spdlog::warn(
        "file locks do not work on {}: members go by rank, and those of a rank that dies wait for the next "
        "run",
        campaign.store);

  catch_interrupts();
  return guarded(ExitCode::interrupted, [&] {
    const RunningCampaign running{ranks,      campaign,        schema, all,    *device,
                                  simulation, plan.activation, *store, *claims};
    return run_members(running, worker);
  });
}

}  // namespace cohort
