#include "ensemble/progress.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "ensemble/status.hpp"
#include "tests/robustness/fake_campaign.hpp"

namespace cohort {
namespace {

TEST(Progress, LineSaysWhatIsDoneAndWhatIsLeft) {
  std::vector<Status> all(64, Status::queued);
  std::fill_n(all.begin(), 37, Status::done);
  all[40] = Status::failed;
  all[41] = Status::unstable;
  all[42] = Status::running;
  EXPECT_EQ(progress_line(StatusCounts(all), std::nullopt), "37/64 done, 2 failed, 1 running");
  // 25 are left at 1000 an hour: 90 s.
  EXPECT_EQ(progress_line(StatusCounts(all), 1000.0),
            "37/64 done, 2 failed, 1 running | 1000 hearts/h | 0:01:30 left");
  EXPECT_EQ(progress_line(StatusCounts(std::vector<Status>(2, Status::done)), 10.0),
            "2/2 done, 0 failed, 0 running | 10 hearts/h");
}

TEST(Progress, Durations) {
  EXPECT_EQ(duration_text(0), "0:00:00");
  EXPECT_EQ(duration_text(3723.4), "1:02:03");
  EXPECT_EQ(duration_text(360000), "100:00:00");
}

TEST(Status, ExitCodes) {
  EXPECT_EQ(exit_code({Status::done, Status::done}), 0);
  EXPECT_EQ(exit_code({Status::done, Status::rejected}), 2);
  EXPECT_EQ(exit_code({Status::done, Status::running}), 3);
  EXPECT_EQ(exit_code({Status::failed, Status::queued}), 3);
}

TEST(Status, ReportCountsAndGathersReasons) {
  const auto path =
      std::filesystem::path(::testing::TempDir()) / ("status_" + std::to_string(getpid()) + ".h5");
  const auto campaign = fake::campaign(20);
  const auto schema = make_schema(campaign, sample(campaign), fake::layout(), "test");
  Claims claims(path);
  create_store(path, schema, claims);
  Store store(path, Store::Access::write);
  EXPECT_EQ(status_command(path, false), 0);
  work(store, claims, schema.samples, members(campaign),
       fake::run(schema.layout, std::chrono::milliseconds(50)), {});
  const auto report = status_report(store);
  EXPECT_NE(report.find(": 20 members\n  done      17\n  failed    1\n  unstable  1\n  rejected  1\n"),
            std::string::npos)
      << report;
  EXPECT_NE(report.find("1 x unstable: made to fail: member 5 (members 5)"), std::string::npos) << report;
  // One at a time, 50 ms each and the commit: below 72000 an hour, and not far below.
  const auto rate = hearts_per_hour(store);
  ASSERT_TRUE(rate);
  EXPECT_LT(*rate, 72000);
  EXPECT_GT(*rate, 7200);
  EXPECT_EQ(status_command(path, true), 0);  // ends: all have ended
  EXPECT_EQ(status_command(path.string() + ".missing", false), 1);
  EXPECT_EQ(verify_command(path.string() + ".missing"), 1);
  std::filesystem::remove(path);
  std::filesystem::remove(path.string() + ".claims");
}

TEST(Status, WhatFailedIsNoHeart) {
  const auto path =
      std::filesystem::path(::testing::TempDir()) / ("hearts_" + std::to_string(getpid()) + ".h5");
  const auto campaign = fake::campaign(4);
  const auto schema = make_schema(campaign, sample(campaign), fake::layout(), "test");
  const auto fail = [](std::span<const Member> batch, double) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    std::vector<Recording> recordings(batch.size());
    for (auto& recording : recordings) recording.outcome = Outcome::rejected;
    return recordings;
  };
  Claims claims(path);
  create_store(path, schema, claims);
  Store store(path, Store::Access::write);
  work(store, claims, schema.samples, members(campaign), fail, {});
  EXPECT_FALSE(hearts_per_hour(store));
  std::filesystem::remove(path);
  std::filesystem::remove(path.string() + ".claims");
}

}  // namespace
}  // namespace cohort
