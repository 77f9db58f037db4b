// configs/reentry.yaml: cross-field stimulation leaves a wave that turns with no stimulus.
#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

const char* probes[] = {"upper_left", "upper_right", "lower_left", "lower_right"};
constexpr double end_ms = 1700;

TEST(Reentry, LastsBeyondASecondWithNoStimulus) {
  const CampaignRun run("configs/reentry.yaml", {"time.end_ms=1700"});
  ASSERT_EQ(run.recording().outcome, Outcome::done) << run.recording().reason;
  constexpr double last_stimulus_ms = 565, turn_ms = 400;
  for (const char* probe : probes) {
    // S1 once, S2 once at most: from the third on no stimulus has caused it.
    EXPECT_GE(run.feature(std::string("activations_") + probe), 3) << probe;
    EXPECT_GT(run.feature(std::string("activation_latest_") + probe + "_ms"), end_ms - turn_ms) << probe;
  }
  EXPECT_GT(run.feature("activation_latest_tissue_ms"), last_stimulus_ms + 1000);
}

TEST(Reentry, TakesBothStimuli) {
  // S2 far too late finds all tissue recovered: two waves cross the sheet and nothing stays.
  const CampaignRun late("configs/reentry.yaml", {"time.end_ms=1700", "stimuli.s2.start_ms=800"});
  for (const char* probe : probes) EXPECT_EQ(late.feature(std::string("activations_") + probe), 2) << probe;
  EXPECT_LT(late.feature("activation_latest_tissue_ms"), 1500);
}

}  // namespace
}  // namespace cohort::test
