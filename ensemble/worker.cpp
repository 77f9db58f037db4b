#include "ensemble/worker.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <thread>

#include "ensemble/batch_guard.hpp"
#include "ensemble/interrupt.hpp"

namespace cohort {
namespace {

constexpr std::size_t culprits_of_a_broken_device = 3;
// A process is killed by its job's limits or its user far more often than by its member: so many kills are
// needed to blame the member; from the second on it is tried alone.
constexpr int kills_to_blame = 5, kills_to_suspect = 2;
constexpr auto poll = std::chrono::milliseconds(100);

struct Claimed {
  const Member* member;
  Account account;
};

class Worker {
 public:
  Worker(Store& store, Claims& claims, const Samples& samples, std::span<const Member> members,
         const RunBatch& run, const WorkerOptions& options)
      : store_(store),
        claims_(claims),
        samples_(samples),
        members_(members),
        run_(run),
        options_(options),
        guard_(store.file(),
               options.hang_after.count() > 0 ? options.hang_after
                                              : std::chrono::duration<double>(2 * options.timeout_s + 60),
               options.grace) {}

  WorkerEnd loop() {
    while (interrupts() == 0) {
      if (simulated_a_batch()) continue;
      if (others_are_at_work()) {
        std::this_thread::sleep_for(poll);
      } else {
        return WorkerEnd::finished;
      }
    }
    return WorkerEnd::interrupted;
  }

 private:
  /// Lets go of what the worker holds, however a batch ends. The locks are those of Claims, which may live on
  /// while this rank waits for the others: they would wait for its members for ever.
  class Hold {
   public:
    explicit Hold(Worker& worker) : worker_(worker) {}
    ~Hold() { worker_.let_go(); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    Worker& worker_;
  };

  /// False where there is nothing to claim.
  bool simulated_a_batch() {
    const Hold hold(*this);
    const auto batch = claim();
    if (!batch.empty()) simulate(batch);
    return !batch.empty();
  }

  bool try_claim(std::int64_t id) {
    held_.reserve(held_.size() + 1);  // nothing may throw between the lock and its entry
    const bool mine = options_.locks ? claims_.try_claim(id) : id % options_.ranks == options_.rank;
    if (mine) held_.push_back(id);
    return mine;
  }
  void release(std::int64_t id) {
    if (options_.locks) claims_.release(id);
    std::erase(held_, id);
  }

  void let_go() noexcept {
    for (const auto id : held_) {
      queue_if_running(id);
      try {
        if (options_.locks) claims_.release(id);
      } catch (const std::exception& error) {
        spdlog::error("rank {}: {}", options_.rank, error.what());
      }
    }
    held_.clear();
  }

  /// After an exception: the member has not ended, whatever went wrong.
  void queue_if_running(std::int64_t id) noexcept try {
    if (store_.status(id) == Status::running) store_.set_status(id, Status::queued);
  } catch (const std::exception& error) {
    // It stays "running" without a lock, which the next to claim takes as well.
    spdlog::error("rank {}: {} {} cannot be queued again: {}", options_.rank, options_.row, id, error.what());
  }

  bool others_are_at_work() const {
    if (!options_.locks || !options_.wait_for_others) return false;
    const auto all = store_.statuses();
    return std::any_of(all.begin(), all.end(),
                       [](Status s) { return s == Status::queued || s == Status::running; });
  }

  /// Whether a member of that status is to be run: an earlier run may have ended it with fewer retries.
  bool is_open(std::int64_t id, Status status) const {
    if (status == Status::queued || status == Status::running) return true;
    return may_try_again(status, store_.account(id), options_.retries);
  }

  /// A member that is "running" and was free to claim: the process that ran it was killed. True where that
  /// has happened so often that the member has ended with it.
  bool given_up_after_kill(std::int64_t id, Account account) {
    claims_.count_kill(id);
    const int kills = claims_.kills(id);
    spdlog::warn("rank {}: the process that ran {} {} was killed (time {} for it)", options_.rank,
                 options_.row, id, kills);
    if (kills < std::max(kills_to_blame, options_.retries + 1)) {
      store_.set_status(id, Status::queued);  // counted
      return false;
    }
    Recording recording;
    recording.outcome = Outcome::failed;
    recording.reason = fmt::format(
        "the process that ran it was killed {} times: out of memory, or a limit of the job?", kills);
    account.attempts = std::max(account.attempts, kills);
    account.rank = options_.rank;
    account.device = options_.device;
    const RowImage row = store_.prepare(id, samples_, recording, account);
    store_.commit({&row, 1});
    return true;
  }

  /// Up to members_per_device members that are open; of those running, the ones without a living process. A
  /// suspect comes alone.
  std::vector<Claimed> claim() {
    std::vector<Claimed> batch;
    const auto before = store_.statuses();
    for (const auto& member : members_) {
      if (static_cast<int>(batch.size()) == options_.members_per_device) break;
      const auto seen = before[static_cast<std::size_t>(member.id)];
      if (!is_open(member.id, seen) || !try_claim(member.id)) continue;
      // Only now is the row ours: another process may have ended it since we looked.
      const auto status = store_.status(member.id);
      auto account = store_.account(member.id);
      if (status == Status::running && given_up_after_kill(member.id, account)) {
        release(member.id);
        continue;
      }
      const bool suspect = account.crashes > 0 || claims_.kills(member.id) >= kills_to_suspect;
      if (!is_open(member.id, status) || (suspect && !batch.empty())) {
        release(member.id);
        continue;
      }
      if (status == Status::unstable) {  // in the file before anything can happen to this process
        ++account.halvings;
        store_.commit(std::vector{store_.prepare_requeue(member.id, account)});
      }
      account.rank = options_.rank;
      account.device = options_.device;
      batch.push_back({&member, std::move(account)});
      if (suspect) break;
    }
    return batch;
  }

  /// The row of an attempt that ended as `recording`, or one that queues the member again.
  RowImage row_after_attempt(const Claimed& claimed, const Recording& recording) const {
    auto account = claimed.account;
    ++account.attempts;
    const Status status = status_of(recording.outcome);
    const std::int64_t id = claimed.member->id;
    if (may_try_again(status, account, options_.retries)) {
      const bool first = status == Status::unstable && account.halvings++ == 0;
      return store_.prepare_requeue(id, account, first ? recording.reason : "");
    }
    if (status == Status::done || claimed.account.halvings == 0)
      return store_.prepare(id, samples_, recording, account);
    Recording told = recording;
    told.reason += first_cause(store_.reason(id));
    return store_.prepare(id, samples_, told, account);
  }

  /// What a row that was halved says of its first attempt. A process killed while it wrote the row may have
  /// left both there.
  static std::string first_cause(const std::string& reason) {
    const std::string joint = "; with the whole step it was: ";
    const std::size_t place = reason.find(joint);
    const std::string first = place == std::string::npos ? reason : reason.substr(place + joint.size());
    return first.empty() ? first : joint + first;
  }

  /// Rows for a batch that took its process with it, or threw. Among several the culprit is not known: each
  /// is tried alone.
  std::vector<RowImage> rows_after_accident(const std::vector<Claimed>& batch, Outcome outcome,
                                            const std::string& reason) const {
    std::vector<RowImage> rows;
    for (const auto& claimed : batch) {
      if (batch.size() == 1) {
        Recording recording;
        recording.outcome = outcome;
        recording.reason = reason;
        rows.push_back(row_after_attempt(claimed, recording));
      } else {
        auto account = claimed.account;
        ++account.crashes;
        rows.push_back(store_.prepare_requeue(claimed.member->id, account));
      }
    }
    return rows;
  }

  std::vector<RowImage> rows_as_they_were(const std::vector<Claimed>& batch) const {
    std::vector<RowImage> rows;
    for (const auto& claimed : batch)
      rows.push_back(store_.prepare_requeue(claimed.member->id, claimed.account));
    return rows;
  }

  void simulate(const std::vector<Claimed>& batch) {
    std::vector<Member> members;
    for (const auto& claimed : batch) {
      members.push_back(*claimed.member);
      if (claimed.account.halvings > 0)
        spdlog::info("{} {}: its steps times {}", options_.row, claimed.member->id,
                     step_factor(claimed.account.halvings));
      for (const std::size_t place : options_.step_factors)
        members.back().values[place] *= step_factor(claimed.account.halvings);
      store_.set_status(claimed.member->id, Status::running);
    }
    guard_.begin({.crash = rows_after_accident(batch, Outcome::failed, "crashed the process that ran it"),
                  .hang = rows_after_accident(batch, Outcome::timeout, "the device did not answer in time"),
                  .abandon = rows_as_they_were(batch)});
    std::vector<Recording> recordings;
    try {
      recordings = run_(members, options_.timeout_s);
      if (recordings.size() != batch.size())
        throw std::logic_error("a batch returned another number of recordings than members");
    } catch (const std::exception& error) {
      guard_.end();
      after_exception(batch, error);
      return;
    }
    guard_.end();
    accused_.clear();
    std::vector<RowImage> rows;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      log(*batch[i].member, recordings[i]);
      rows.push_back(row_after_attempt(batch[i], recordings[i]));
    }
    store_.commit(rows);
  }

  /// Keeps the fewest batches without a member in common: one bad member explains all that share it, tried
  /// again or first among others.
  void accuse(const std::vector<Claimed>& batch) {
    std::set<std::int64_t> ids;
    for (const auto& claimed : batch) ids.insert(claimed.member->id);
    const auto shares = [&](const auto& other) {
      return std::any_of(other.begin(), other.end(), [&](auto id) { return ids.contains(id); });
    };
    const auto explains = [&](const auto& other) { return other.size() <= ids.size() && shares(other); };
    if (std::any_of(accused_.begin(), accused_.end(), explains)) return;
    std::erase_if(accused_, shares);
    accused_.push_back(std::move(ids));
  }

  /// Called in a catch clause.
  void after_exception(const std::vector<Claimed>& batch, const std::exception& error) {
    accuse(batch);
    if (accused_.size() == culprits_of_a_broken_device) {
      store_.commit(rows_as_they_were(batch));
      spdlog::error("rank {}: {} members have failed in a row, the last with \"{}\": the device is at fault",
                    options_.rank, accused_.size(), error.what());
      throw;
    }
    spdlog::warn("rank {}: a batch of {} failed: {}", options_.rank, batch.size(), error.what());
    store_.commit(rows_after_accident(batch, Outcome::failed, std::string("device: ") + error.what()));
  }

  void log(const Member& member, const Recording& recording) const {
    if (recording.outcome == Outcome::done)
      spdlog::debug("{} {} done in {:.2f} s", options_.row, member.id, recording.wall_s);
    else
      spdlog::warn("{} {} {}: {}", options_.row, member.id,
                   status_names[static_cast<std::size_t>(recording.outcome)], recording.reason);
  }

  Store& store_;
  Claims& claims_;
  const Samples& samples_;
  std::span<const Member> members_;
  const RunBatch& run_;
  const WorkerOptions& options_;
  BatchGuard guard_;
  std::vector<std::int64_t> held_;
  std::vector<std::set<std::int64_t>> accused_;  ///< of exceptions since the last batch that came back
};

}  // namespace

bool may_try_again(Status status, const Account& account, int retries) {
  if (status == Status::unstable) return account.halvings < std::min(retries, most_halvings);
  if (status != Status::failed && status != Status::timeout) return false;
  return account.attempts - account.halvings <= retries;
}

WorkerEnd work(Store& store, Claims& claims, const Samples& samples, std::span<const Member> members,
               const RunBatch& run, const WorkerOptions& options) {
  return Worker(store, claims, samples, members, run, options).loop();
}

}  // namespace cohort
