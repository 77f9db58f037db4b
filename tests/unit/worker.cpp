#include "ensemble/worker.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "ensemble/batch_guard.hpp"
#include "ensemble/interrupt.hpp"
#include "ensemble/status.hpp"
#include "tests/robustness/fake_campaign.hpp"

namespace cohort {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

class WorkerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("worker_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = folder_ / "a.h5";
    schema_ = make_schema(campaign_, sample(campaign_), layout_, "test");
    members_ = members(campaign_);
    options_.members_per_device = 4;
    Claims claims(path_);
    create_store(path_, schema_, claims);
  }
  void TearDown() override { fs::remove_all(folder_); }

  WorkerEnd work(const RunBatch& run) {
    Claims claims(path_);
    Store store(path_, Store::Access::write);
    return cohort::work(store, claims, schema_.samples, members_, run, options_);
  }
  /// Works in a process of its own. Returns what wait() says of it.
  int work_apart(const RunBatch& run) {
    const pid_t child = fork();
    if (child == 0) {
      catch_interrupts();
      _exit(work(run) == WorkerEnd::interrupted ? exit_interrupted : 0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return status;
  }
  std::vector<Status> expected() const {
    std::vector<Status> all(20, Status::done);
    all[5] = Status::unstable;
    all[11] = Status::rejected;
    all[17] = Status::failed;
    return all;
  }

  Campaign campaign_ = fake::campaign(20);
  Layout layout_ = fake::layout();
  Schema schema_;
  std::vector<Member> members_;
  WorkerOptions options_;
  fs::path folder_, path_;
};

TEST_F(WorkerTest, EveryMemberEndsAndFailuresDoNotStopTheCampaign) {
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  const Store store(path_);
  EXPECT_EQ(store.statuses(), expected());
  EXPECT_EQ(store.reason(5), "made to fail: member 5");
  EXPECT_EQ(exit_code(store.statuses()), 2);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(store.row_is_intact(i));
}

TEST_F(WorkerTest, RetriesWhatMayBeTriedAgain) {
  options_.retries = 2;
  std::map<std::int64_t, int> tries;
  const auto run = [&](std::span<const Member> batch, double) {
    std::vector<Recording> recordings;
    for (const auto& member : batch) {
      recordings.push_back(fake::simulate(member, layout_));
      if (++tries[member.id] == 1 && member.id == 2) {
        recordings.back() = {};
        recordings.back().outcome = Outcome::timeout;
      }
    }
    return recordings;
  };
  EXPECT_EQ(work(run), WorkerEnd::finished);
  const Store store(path_);
  EXPECT_EQ(store.statuses(), expected());
  EXPECT_EQ(tries[1], 1);
  EXPECT_EQ(tries[2], 2);   // a timeout, then done
  EXPECT_EQ(tries[5], 3);   // unstable
  EXPECT_EQ(tries[11], 1);  // rejected: the same again would be
  EXPECT_EQ(tries[17], 3);  // failed
  EXPECT_EQ(store.account(5).attempts, 3);
  EXPECT_EQ(store.account(2).attempts, 2);
}

/// Member 3 is unstable with steps (the fake campaign's last parameter) of more than `bound`.
RunBatch bounded(const Layout& layout, double bound) {
  return [=](std::span<const Member> batch, double) {
    std::vector<Recording> recordings;
    for (const auto& member : batch) {
      recordings.push_back(fake::simulate(member, layout));
      if (member.id != 3 || member.values[2] <= bound) continue;
      recordings.back() = {};
      recordings.back().outcome = Outcome::unstable;
    }
    return recordings;
  };
}

TEST_F(WorkerTest, RetriesOfTheUnstableHalveTheirSteps) {
  options_.step_factors = {2};  // 150 of all members
  options_.retries = 3;
  EXPECT_EQ(work(bounded(layout_, 40)), WorkerEnd::finished);
  const Store store(path_);
  EXPECT_EQ(store.statuses(), expected());
  EXPECT_EQ(store.account(3).attempts, 3);
  EXPECT_EQ(store.account(3).halvings, 2);  // 37.5
  EXPECT_EQ(store.account(4).halvings, 0);
  EXPECT_EQ(store.account(5).halvings, 3);
  EXPECT_EQ(store.account(17).halvings, 0);  // failed: tried again as it is
  EXPECT_EQ(store.account(17).attempts, 4);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(store.row_is_intact(i));
}

TEST_F(WorkerTest, HalvingsEndAndTheFirstCauseStays) {
  options_.step_factors = {2};
  options_.retries = 30;
  const auto run = [&](std::span<const Member> batch, double timeout) {
    std::vector<Recording> recordings = bounded(layout_, 1e-9)(batch, timeout);
    for (std::size_t m = 0; m < batch.size(); ++m) {
      const bool whole = batch[m].values[2] == members_[static_cast<std::size_t>(batch[m].id)].values[2];
      if (batch[m].id == 3) recordings[m].reason = whole ? "the first cause" : "a later one";
    }
    return recordings;
  };
  EXPECT_EQ(work(run), WorkerEnd::finished);
  const Store store(path_);
  EXPECT_EQ(store.account(3).halvings, most_halvings);
  EXPECT_EQ(store.account(3).attempts, most_halvings + 1);
  EXPECT_EQ(store.reason(3), "a later one; with the whole step it was: the first cause");
  EXPECT_TRUE(store.row_is_intact(3));
}

TEST_F(WorkerTest, StepsAreHalvedByALaterRunToo) {
  options_.step_factors = {2};
  EXPECT_EQ(work(bounded(layout_, 80)), WorkerEnd::finished);
  EXPECT_EQ(Store(path_).status(3), Status::unstable);
  EXPECT_EQ(Store(path_).account(3).halvings, 0);
  options_.retries = 1;
  EXPECT_EQ(work(bounded(layout_, 80)), WorkerEnd::finished);
  EXPECT_EQ(Store(path_).status(3), Status::done);
  EXPECT_EQ(Store(path_).account(3).halvings, 1);
}

TEST_F(WorkerTest, NeitherKillsNorTimeoutsHalveSteps) {
  options_.step_factors = {2};
  options_.retries = 2;
  options_.members_per_device = 1;
  const fs::path calls = folder_ / "calls";
  // Of member 3: unstable, killed, a timeout, unstable, killed, done.
  const auto run = [&](std::span<const Member> batch, double timeout) {
    std::vector<Recording> recordings = bounded(layout_, 40)(batch, timeout);
    if (batch[0].id != 3) return recordings;
    fs::create_directories(calls);
    const auto call = std::distance(fs::directory_iterator(calls), fs::directory_iterator());
    fs::create_directory(calls / std::to_string(call));
    if (call == 1 || call == 4) raise(SIGKILL);
    if (call != 2) return recordings;
    recordings[0] = {};
    recordings[0].outcome = Outcome::timeout;
    return recordings;
  };
  int kills = 0;
  for (int status = -1; status != 0 && kills < 10; kills += status != 0) status = work_apart(run);
  EXPECT_EQ(kills, 2);
  const Store store(path_);
  EXPECT_EQ(store.status(3), Status::done);
  EXPECT_EQ(store.account(3).halvings, 2);
  EXPECT_EQ(store.account(3).attempts, 4);
  EXPECT_TRUE(store.row_is_intact(3));
}

TEST_F(WorkerTest, ALaterRunWithMoreRetriesTriesAgainWhatFailed) {
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  std::vector<std::int64_t> tried;
  const auto run = [&](std::span<const Member> batch, double) {
    std::vector<Recording> recordings;
    for (const auto& member : batch) {
      tried.push_back(member.id);
      recordings.push_back(fake::simulate(members_[0], layout_));
    }
    return recordings;
  };
  EXPECT_EQ(work(run), WorkerEnd::finished);
  EXPECT_TRUE(tried.empty());
  options_.retries = 1;
  EXPECT_EQ(work(run), WorkerEnd::finished);
  EXPECT_EQ(tried, (std::vector<std::int64_t>{5, 17}));
  const Store store(path_);
  EXPECT_EQ(store.status(5), Status::done);
  EXPECT_EQ(store.status(11), Status::rejected);
  EXPECT_EQ(store.account(17).attempts, 2);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(store.row_is_intact(i));
}

TEST_F(WorkerTest, TakesWhatADeadProcessLeftRunningAndNotWhatALiveOneHas) {
  Store store(path_, Store::Access::write);
  store.set_status(0, Status::running);  // its process is dead: the lock is free
  store.set_status(1, Status::running);
  Claims other(path_);
  ASSERT_TRUE(other.try_claim(1));
  options_.wait_for_others = false;
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  auto all = expected();
  all[1] = Status::running;
  EXPECT_EQ(store.statuses(), all);
}

TEST_F(WorkerTest, WaitsForOthersAndTakesOverFromThem) {
  const pid_t other = fork();
  if (other == 0) {  // claims member 1 and dies
    Claims claims(path_);
    claims.try_claim(1);
    usleep(500000);
    raise(SIGKILL);
  }
  while (!Claims(path_).is_claimed_elsewhere(1)) usleep(1000);
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  EXPECT_EQ(Store(path_).statuses(), expected());
  waitpid(other, nullptr, 0);
}

TEST_F(WorkerTest, WithoutLocksMembersGoByRank) {
  options_.locks = false;
  options_.ranks = 2;
  options_.rank = 1;
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  const auto all = Store(path_).statuses();
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(all[i] == Status::queued, i % 2 == 0);
}

TEST_F(WorkerTest, AnInterruptLetsTheBatchEndAndClaimsNoMore) {
  const auto run = [&](std::span<const Member> batch, double timeout) {
    raise(SIGTERM);
    return fake::run(layout_)(batch, timeout);
  };
  EXPECT_EQ(WEXITSTATUS(work_apart(run)), exit_interrupted);
  auto all = std::vector<Status>(20, Status::queued);
  std::fill_n(all.begin(), 4, Status::done);
  EXPECT_EQ(Store(path_).statuses(), all);
}

TEST_F(WorkerTest, ABatchThatOutlivesTheGraceGoesBackToTheQueue) {
  options_.grace = milliseconds(100);
  const auto run = [&](std::span<const Member> batch, double timeout) {
    raise(SIGTERM);
    return fake::run(layout_, milliseconds(30000))(batch, timeout);
  };
  EXPECT_EQ(WEXITSTATUS(work_apart(run)), exit_interrupted);
  EXPECT_EQ(Store(path_).statuses(), std::vector<Status>(20, Status::queued));
  EXPECT_EQ(Store(path_).account(0).attempts, 0);
}

TEST_F(WorkerTest, ACrashCostsOnlyTheMemberThatCrashes) {
  const auto run = [&](std::span<const Member> batch, double timeout) {
    for (const auto& member : batch)
      if (member.id == 9) raise(SIGSEGV);
    return fake::run(layout_)(batch, timeout);
  };
  int crashes = 0;
  for (int status = -1; status != 0 && crashes < 10; crashes += status != 0) {
    status = work_apart(run);
    // Handed on to what the signal did before: the end, or under AddressSanitizer a report and exit 1.
    if (WIFSIGNALED(status)) {
      EXPECT_EQ(WTERMSIG(status), SIGSEGV);
    }
  }
  EXPECT_EQ(crashes, 2);  // once among four, once alone
  auto all = expected();
  all[9] = Status::failed;
  const Store store(path_);
  EXPECT_EQ(store.statuses(), all);
  EXPECT_EQ(store.reason(9), "crashed the process that ran it");
  EXPECT_TRUE(store.row_is_intact(9));
  EXPECT_EQ(store.account(9).attempts, 1);
}

// SIGKILL leaves no last will: the next process finds the member running and unclaimed.
TEST_F(WorkerTest, AMemberThatGetsItsProcessKilledIsGivenUp) {
  const auto run = [&](std::span<const Member> batch, double timeout) {
    for (const auto& member : batch)
      if (member.id == 9) raise(SIGKILL);
    return fake::run(layout_)(batch, timeout);
  };
  const auto kills = [&] {
    int count = 0;
    for (int status = -1; status != 0 && count < 20; count += status != 0) {
      status = work_apart(run);
      EXPECT_TRUE(status == 0 || (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)) << status;
    }
    return count;
  };
  EXPECT_EQ(kills(), 5);  // twice among four, three times alone
  auto all = expected();
  all[9] = Status::failed;
  {
    const Store store(path_);
    EXPECT_EQ(store.statuses(), all);
    EXPECT_EQ(store.reason(9),
              "the process that ran it was killed 5 times: out of memory, or a limit of the job?");
    EXPECT_TRUE(store.row_is_intact(9));
    EXPECT_EQ(store.account(9).attempts, 5);
    EXPECT_EQ(store.account(8).attempts, 1);
  }
  EXPECT_EQ(kills(), 0);  // it stays ended
  options_.retries = 7;
  EXPECT_EQ(kills(), 3);  // eight in all
  EXPECT_EQ(Store(path_).statuses(), all);
}

TEST_F(WorkerTest, ProcessesThatAreKilledFromOutsideCostNoMember) {
  int calls = 0;
  const auto run = [&](std::span<const Member> batch, double timeout) {
    if (++calls > 1) raise(SIGKILL);  // in a process of its own: each ends one batch
    return fake::run(layout_)(batch, timeout);
  };
  int kills = 0;
  for (int status = -1; status != 0 && kills < 50; kills += status != 0) status = work_apart(run);
  EXPECT_GE(kills, 4);
  EXPECT_EQ(Store(path_).statuses(), expected());
}

TEST_F(WorkerTest, AHangCostsOnlyTheMemberThatHangs) {
  options_.hang_after = milliseconds(200);
  const auto run = [&](std::span<const Member> batch, double timeout) {
    for (const auto& member : batch)
      if (member.id == 9) pause();
    return fake::run(layout_)(batch, timeout);
  };
  int hangs = 0;
  for (int status = -1; status != 0 && hangs < 10; hangs += status != 0) {
    status = work_apart(run);
    EXPECT_TRUE(status == 0 || WEXITSTATUS(status) == exit_interrupted) << status;
  }
  EXPECT_EQ(hangs, 2);
  auto all = expected();
  all[9] = Status::timeout;
  const Store store(path_);
  EXPECT_EQ(store.statuses(), all);
  EXPECT_EQ(store.reason(9), "the device did not answer in time");
  EXPECT_TRUE(store.row_is_intact(9));
}

TEST_F(WorkerTest, AnExceptionIsTheMembersUntilItIsTheDevices) {
  const auto one_bad = [&](std::span<const Member> batch, double timeout) {
    for (const auto& member : batch)
      if (member.id == 9) throw std::runtime_error("clEnqueueNDRangeKernel");
    return fake::run(layout_)(batch, timeout);
  };
  EXPECT_EQ(work(one_bad), WorkerEnd::finished);
  auto all = expected();
  all[9] = Status::failed;
  EXPECT_EQ(Store(path_).statuses(), all);
  EXPECT_EQ(Store(path_).reason(9), "device: clEnqueueNDRangeKernel");
}

TEST_F(WorkerTest, ABrokenDeviceDoesNotFailTheWholeCampaign) {
  const auto broken = [](std::span<const Member>, double) -> std::vector<Recording> {
    throw std::runtime_error("no device");
  };
  EXPECT_THROW(work(broken), std::runtime_error);
  const auto counts = Store(path_).statuses();
  EXPECT_LE(std::count(counts.begin(), counts.end(), Status::failed), 2);
  EXPECT_EQ(std::count(counts.begin(), counts.end(), Status::running), 0);
}

TEST_F(WorkerTest, OneBadMemberIsNoBrokenDeviceHoweverOftenItIsTried) {
  options_.retries = 4;
  int throws = 0;
  const auto one_bad = [&](std::span<const Member> batch, double timeout) {
    for (const auto& member : batch)
      if (member.id == 9) throw std::runtime_error("throw " + std::to_string(++throws));
    return fake::run(layout_)(batch, timeout);
  };
  EXPECT_EQ(work(one_bad), WorkerEnd::finished);
  EXPECT_EQ(throws, 6);  // among four, then five times alone
  auto all = expected();
  all[9] = Status::failed;
  EXPECT_EQ(Store(path_).statuses(), all);
  EXPECT_EQ(Store(path_).account(9).attempts, 5);
}

TEST_F(WorkerTest, AWorkerThatThrowsLeavesItsMembersToTheOthers) {
  const auto broken = [](std::span<const Member>, double) -> std::vector<Recording> {
    throw std::runtime_error("no device");
  };
  Claims claims(path_);  // outlives the worker, as where its rank waits for the others
  Store store(path_, Store::Access::write);
  EXPECT_THROW(cohort::work(store, claims, schema_.samples, members_, broken, options_), std::runtime_error);
  options_.wait_for_others = false;  // would be for ever
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  auto all = expected();
  all[0] = all[1] = Status::failed;  // alone, before the device was known to be at fault
  EXPECT_EQ(store.statuses(), all);
}

TEST_F(WorkerTest, MembersWhoseRowsCannotBeWrittenGoBackToTheQueue) {
  const auto misshapen = [&](std::span<const Member> batch, double timeout) {
    auto recordings = fake::run(layout_)(batch, timeout);
    for (auto& recording : recordings) recording.ecg.resize(1);
    return recordings;
  };
  Claims claims(path_);
  Store store(path_, Store::Access::write);
  EXPECT_THROW(cohort::work(store, claims, schema_.samples, members_, misshapen, options_), std::logic_error);
  EXPECT_EQ(store.statuses(), std::vector<Status>(20, Status::queued));
  options_.wait_for_others = false;
  EXPECT_EQ(work(fake::run(layout_)), WorkerEnd::finished);
  EXPECT_EQ(store.statuses(), expected());
}

}  // namespace
}  // namespace cohort
