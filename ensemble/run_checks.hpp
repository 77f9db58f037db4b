#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ensemble/claims.hpp"
#include "ensemble/members.hpp"
#include "ensemble/schema.hpp"
#include "ensemble/store.hpp"
#include "ensemble/worker.hpp"

namespace cohort {

/// The reason of a check whose member is not done, as its row has it.
inline constexpr const char* nothing_to_compare = "its member is not done: there is nothing to compare";

/// Seconds of a check for each of its member's, at most: half the spacing in three directions, half the step
/// and twice the beats.
inline constexpr double check_cost = 32;

/// A campaign at half the spacing and the step. All its members are planned for, as those of the campaign
/// are, so that the results of a check do not depend on which others there are. `activation` is the
/// campaign's plan's: chosen anew on the finer grid it could be another model.
struct FineCampaign {
  Scene scene;
  std::vector<Member> members;
};
FineCampaign fine_campaign(const Scene& scene, std::span<const Member> members, ActivationMethod activation);

/// The loop of a rank over the checks of a campaign whose members have ended: work() on the checks' own rows,
/// where `run` simulates fine members. A check whose member is not done is rejected with
/// nothing_to_compare, and is open again once its member is. `options` are those of the members; a check has
/// check_cost times as long.
WorkerEnd work_on_checks(const Store& store, Store& checks, Claims& claims, const Schema& schema,
                         const FineCampaign& fine, const RunBatch& run, WorkerOptions options);

/// Whether a check is to be run, with so many retries.
bool has_open_checks(const Store& store, const Store& checks, const Schema& schema, int retries);

}  // namespace cohort
