// One rank of a campaign without hearts: the store, the claims, the worker, the checks and the errors as in
// the real program, with a simulator that only sleeps. Several of them work on one store like ranks of
// several jobs.
//
//     fake_cohort STORE MEMBERS RANK [MS_PER_BATCH]
//
// Ends like cohort run: 0 all done, 1 the store cannot be had, 2 some failed, 3 interrupted.
#include <spdlog/spdlog.h>

#include <cstdlib>

#include "ensemble/error_estimate.hpp"
#include "ensemble/interrupt.hpp"
#include "ensemble/run_checks.hpp"
#include "ensemble/status.hpp"
#include "ensemble/store.hpp"
#include "tests/robustness/fake_campaign.hpp"

int main(int argc, char** argv) try {
  using namespace cohort;
  if (argc < 4) return 1;
  spdlog::set_level(spdlog::level::err);
  const auto campaign = fake::campaign(std::atoll(argv[2]));
  const auto layout = fake::layout();
  const auto schema = make_schema(campaign, sample(campaign), layout, "fake");
  const std::chrono::milliseconds per_batch(argc > 4 ? std::atoi(argv[4]) : 20);

  catch_interrupts();
  Claims claims(argv[1]);
  create_store(argv[1], schema, claims);
  Store store(argv[1], Store::Access::write);
  store.require(schema);
  WorkerOptions options;
  options.members_per_device = 4;
  options.retries = 1;
  options.rank = std::atoi(argv[3]);
  options.device = "none";
  const auto all = members(campaign, schema.samples);
  if (work(store, claims, schema.samples, all, fake::run(layout, per_batch), options) ==
      WorkerEnd::interrupted)
    return 3;
  Store checks(argv[1], Store::Access::write, checks_group);
  Claims of_checks(argv[1], store.members());
  options.members_per_device = 1;  // fine members are large
  const FineCampaign fine = fine_campaign(campaign.scene, all, campaign.scene.activation_method);
  if (work_on_checks(store, checks, of_checks, schema, fine,
                     fake::run(layout, per_batch, fake::simulate_fine), options) == WorkerEnd::interrupted)
    return 3;
  write_errors(store, schema, claims);
  return exit_code(store);
} catch (const std::exception& error) {
  spdlog::error("{}", error.what());
  return 1;
}
