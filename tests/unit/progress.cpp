#include "ensemble/progress.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "ensemble/performance_report.hpp"
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

// The line of `kernel` in a report.
std::string line_of(const std::string& report, const std::string& kernel) {
  const std::size_t first = report.find("\n" + kernel) + 1;
  return first == 0 ? "" : report.substr(first, report.find('\n', first) - first);
}

TEST(PerformanceReport, GivesRatesOrSaysWhyNot) {
  ProcessPerformance rank;
  rank.device = "some device";
  rank.triad_GB_per_s = 10;
  rank.kernels = {{"compiled_once", 1, 0, 1e6}, {"half", 10, 2, 1e6}, {"sweep", 4, 1, 0}};
  std::string report = performance_report(rank, {});
  EXPECT_TRUE(line_of(report, "compiled_once").empty());
  EXPECT_TRUE(line_of(report, "half").ends_with("5.0      50 %")) << report;  // 10 MB in 2 ms
  EXPECT_TRUE(line_of(report, "sweep").ends_with("-         -")) << report;
  EXPECT_NE(report.find("\n-: "), std::string::npos);
  EXPECT_EQ(report.find("caches"), std::string::npos);

  rank.kernels = {{"small", 10, 2, 4e6}};
  report = performance_report(rank, {});
  EXPECT_TRUE(line_of(report, "small").ends_with("20.0     200 %")) << report;
  EXPECT_NE(report.find("more than 100 %: from the device's caches"), std::string::npos);
  EXPECT_EQ(report.find("\n-: "), std::string::npos);

  rank.kernels = {{"compiled_once", 1, 0, 1e6}};
  EXPECT_NE(performance_report(rank, {}).find("no kernel was timed"), std::string::npos);
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
  auto campaign = fake::campaign(20);
  campaign.check_fraction = 0;
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
