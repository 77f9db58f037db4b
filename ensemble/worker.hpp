#pragma once

#include <chrono>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "ensemble/claims.hpp"
#include "ensemble/members.hpp"
#include "ensemble/store.hpp"

namespace cohort {

/// Simulates a batch: a recording for each member, in their order. Simulation::run, or a stand-in for tests.
using RunBatch = std::function<std::vector<Recording>(std::span<const Member> members, double timeout_s)>;

struct WorkerOptions {
  int members_per_device = 1;
  int retries = 0;
  std::vector<std::size_t> step_factors;  ///< places in a member's values of what a retry halves
  double timeout_s = 3600;
  int rank = 0;
  std::string device;
  std::string row = "member";   ///< what the log calls a row
  int ranks = 1;                ///< with `rank`: whose member is whose where locks do not work
  bool locks = true;            ///< false: members go by rank (see Claims::work and hold_probe)
  bool wait_for_others = true;  ///< stay until every member has ended, to take over from a rank that dies
  std::chrono::duration<double> grace{20};      ///< how long a batch may run on after SIGTERM or SIGINT
  std::chrono::duration<double> hang_after{0};  ///< a batch that takes longer hangs; 0: 2 timeout_s + 60 s
};

enum class WorkerEnd { finished, interrupted };

/// Whether a member that has ended so is tried again: after unstable up to `retries` times with half the
/// steps each, but no more than most_halvings, after failed and timeout as often as it is.
constexpr int most_halvings = 3;
bool may_try_again(Status status, const Account& account, int retries);

/// The loop of one rank: claims members that have not ended, runs them and commits their rows, until none is
/// left or an interrupt comes (catch_interrupts). Members are tried again by this run or a later one with
/// more retries: up to `retries` times after unstable, with half the steps each time, and as often after
/// failed and timeout, as they are; the last outcome stands. How often the steps are halved is the member's
/// own matter: neither kills nor crashes nor time count. A member that crashes or hangs a process together
/// with others is tried alone from then on, and only what it does alone counts as its attempt. Does not
/// return where a batch hangs or must be abandoned: the process ends with exit_interrupted (see BatchGuard).
/// Throws std::runtime_error when the file cannot be written, and what `run` throws when it throws for three
/// different members without a success between: then the device is at fault, not a member. However it leaves,
/// it holds no claim.
WorkerEnd work(Store& store, Claims& claims, const Samples& samples, std::span<const Member> members,
               const RunBatch& run, const WorkerOptions& options);

}  // namespace cohort
