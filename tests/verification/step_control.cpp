// Steps and their factors: order of the beating heart in its step, a step beyond its limit is ended and
// named, and a retry at half of it gives the bits of a run that began so.
#include <unistd.h>

#include <filesystem>

#include "ensemble/worker.hpp"
#include "tests/campaign_run.hpp"
#include "tests/heart_run.hpp"

namespace cohort::test {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> small_heart = {at(8), "time.beats.at_most=1"};

std::vector<std::string> with(std::vector<std::string> changes, const std::string& more) {
  changes.push_back(more);
  return changes;
}

double rms(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i] - b[i]), 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

/// The first member of a campaign, run by a worker to its end.
struct Worked {
  Worked(const Campaign& campaign, int retries)
      : folder(fs::path(testing::TempDir()) / ("step_control_" + std::to_string(getpid()))) {
    fs::remove_all(folder);
    fs::create_directories(folder);
    const Samples samples = sample(campaign);
    const std::vector<Member> all = members(campaign, samples);
    const Schema schema = make_schema(campaign, samples, layout(campaign.scene), "test");
    Claims claims(folder / "a.h5");
    create_store(folder / "a.h5", schema, claims);
    Store store(folder / "a.h5", Store::Access::write);
    Simulation simulation(device(), campaign.scene, make_plan(device(), campaign.scene, all, {}));
    WorkerOptions options;
    options.retries = retries;
    for (const char* path : {"time.step_factor", "mechanics.step_factor"})
      if (const int place = campaign.scene.parameters.find(path); place >= 0)
        options.step_factors.push_back(static_cast<std::size_t>(place));
    work(
        store, claims, samples, all,
        [&](std::span<const Member> batch, double timeout_s) {
          std::vector<Recording> recordings = simulation.run(batch, timeout_s);
          last = recordings.front();
          if (reasons.empty() || last.outcome != Outcome::done) reasons.push_back(last.reason);
          return recordings;
        },
        options);
    status = store.status(0);
    account = store.account(0);
    fs::remove_all(folder);
  }
  fs::path folder;
  Recording last;
  std::vector<std::string> reasons;
  Status status{};
  Account account;
};

TEST(StepFactor, TheBeatingHeartIsOfFirstOrderInItsStep) {
  std::vector<Recording> runs;
  for (const char* factor : {"1", "0.5", "0.25"})
    runs.push_back(beat(with(small_heart, std::string("mechanics.step_factor=") + factor))[0].recording);
  for (const Recording& run : runs) ASSERT_EQ(run.outcome, Outcome::done) << run.reason;
  EXPECT_NEAR(runs[0].dt_ms / runs[1].dt_ms, 2, 0.02);
  const double pressure = rms(runs[0].pressure, runs[1].pressure) / rms(runs[1].pressure, runs[2].pressure),
               volume = rms(runs[0].volume, runs[1].volume) / rms(runs[1].volume, runs[2].volume);
  std::printf(
      "differences of steps 1 and 1/2 over those of 1/2 and 1/4: pressure %.2f (%.3g mmHg), volume %.2f "
      "(%.3g mL)\n",
      pressure, rms(runs[0].pressure, runs[1].pressure), volume, rms(runs[0].volume, runs[1].volume));
  EXPECT_NEAR(pressure, 2, 0.4);
  EXPECT_NEAR(volume, 2, 0.4);
  EXPECT_LT(rms(runs[0].pressure, runs[1].pressure), 0.1);
}

TEST(StepControl, ASolidsStepBeyondItsLimitIsNamedAndHalved) {
  const Campaign plain = campaign_of("heart.yaml", small_heart),
                 twice = campaign_of("heart.yaml", with(small_heart, "mechanics.step_factor=2"));
  const Worked ended(twice, 0), halved(twice, 2), reference(plain, 0);
  EXPECT_EQ(ended.status, Status::unstable);
  const std::string why = ended.reasons.at(0);
  EXPECT_EQ(why.find("the tissue's step of "), 0u) << why;
  for (const char* part : {" ms is beyond the limit of ", ") mm, region ", ", at 0.0 ms"})
    EXPECT_NE(why.find(part), std::string::npos) << why;
  EXPECT_EQ(halved.status, Status::done);
  EXPECT_EQ(halved.account.attempts, 2);
  EXPECT_EQ(step_factor(halved.account.halvings), 0.5);
  EXPECT_EQ(halved.last.pressure, reference.last.pressure);
  EXPECT_EQ(halved.last.ecg.size(), reference.last.ecg.size());
}

TEST(StepControl, AReactionsStepBeyondItsLimitIsNamedAndHalved) {
  const Campaign campaign = campaign_of("slab.yaml", {"time.dt_ms=1", "time.end_ms=20", "grid.dx_mm=1",
                                                      "scene.electrophysiology.activation=monodomain"});
  const Worked ended(campaign, 0), halved(campaign, 1);
  EXPECT_EQ(ended.status, Status::unstable);
  EXPECT_EQ(ended.reasons.at(0),
            "the reaction's step of 1 ms is beyond the limit of 0.5714 ms of its fastest rate, at 0 ms");
  EXPECT_EQ(halved.status, Status::done);
  EXPECT_EQ(halved.account.attempts, 2);
  EXPECT_EQ(halved.last.dt_ms, 0.5);
}

}  // namespace
}  // namespace cohort::test
