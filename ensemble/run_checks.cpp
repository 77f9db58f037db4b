#include "ensemble/run_checks.hpp"

#include <algorithm>

#include "ensemble/half_steps.hpp"

namespace cohort {
namespace {

/// A check that was rejected for want of its member, which has been done since.
bool is_wanted_again(const Store& store, const Store& checks, const Schema& schema, std::int64_t check) {
  return checks.status(check) == Status::rejected &&
         store.status(schema.checked[static_cast<std::size_t>(check)]) == Status::done &&
         checks.reason(check) == nothing_to_compare;
}

void queue_wanted(const Store& store, Store& checks, Claims& claims, const Schema& schema,
                  const WorkerOptions& options) {
  for (std::int64_t check = 0; check < checks.members(); ++check) {
    if (!is_wanted_again(store, checks, schema, check)) continue;
    if (options.locks ? !claims.try_claim(check) : check % options.ranks != options.rank) continue;
    if (is_wanted_again(store, checks, schema, check))  // another process may have run it since
      checks.commit(std::vector{checks.prepare_requeue(check, {})});
    if (options.locks) claims.release(check);
  }
}

Recording rejected() {
  Recording recording;
  recording.outcome = Outcome::rejected;
  recording.reason = nothing_to_compare;
  return recording;
}

}  // namespace

FineCampaign fine_campaign(const Scene& scene, std::span<const Member> members, ActivationMethod activation) {
  FineCampaign fine{half_steps(scene), {}};
  fine.scene.activation_method = activation;
  for (const Member& member : members) fine.members.push_back(half_steps(scene, member));
  return fine;
}

bool has_open_checks(const Store& store, const Store& checks, const Schema& schema, int retries) {
  for (std::int64_t check = 0; check < checks.members(); ++check) {
    const Status status = checks.status(check);
    if (!is_final(status) || may_try_again(status, checks.account(check), retries) ||
        is_wanted_again(store, checks, schema, check))
      return true;
  }
  return false;
}

WorkerEnd work_on_checks(const Store& store, Store& checks, Claims& claims, const Schema& schema,
                         const FineCampaign& fine, const RunBatch& run, WorkerOptions options) {
  options.timeout_s *= check_cost;
  options.row = "check";
  queue_wanted(store, checks, claims, schema, options);
  std::vector<Member> rows;
  for (std::int64_t check = 0; check < checks.members(); ++check) {
    const auto member = schema.checked[static_cast<std::size_t>(check)];
    rows.push_back({check, fine.members[static_cast<std::size_t>(member)].values});
    // Half the step with which the member was done, should retries have halved it.
    for (const std::size_t place : options.step_factors)
      rows.back().values[place] *= step_factor(store.account(member).halvings);
  }
  const RunBatch run_those_done = [&](std::span<const Member> batch, double timeout_s) {
    std::vector<Recording> recordings(batch.size(), rejected());
    std::vector<Member> members;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto member = schema.checked[static_cast<std::size_t>(batch[i].id)];
      const Status status = store.status(member);
      if (is_final(status) && status != Status::done) continue;
      members.push_back({member, batch[i].values});
      places.push_back(i);
    }
    if (members.empty()) return recordings;
    auto simulated = run(members, timeout_s);
    for (std::size_t i = 0; i < places.size(); ++i) recordings[places[i]] = std::move(simulated.at(i));
    return recordings;
  };
  const Samples samples = rows_of(schema.samples, schema.checked);
  return work(checks, claims, samples, rows, run_those_done, options);
}

}  // namespace cohort
