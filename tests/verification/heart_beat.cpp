// The beating heart of configs/heart.yaml against what is normal in healthy adults
// (tests/reference/physiology.yaml): at 4 mm on a CPU, at 2 mm with the halved spacing on a GPU.
#include "tests/heart_run.hpp"

namespace cohort::test {
namespace {

TEST(HeartBeat, IsThatOfAHealthyAdult) {
  const Beat beat = test::beat({at(spacing())})[0];
  ASSERT_EQ(beat.recording.outcome, Outcome::done) << beat.recording.reason;
  expect_healthy(beat);
  for (const char* name : {"beats", "beat_difference", "valve_switches", "ringing_mmHg", "blood_apart_mL",
                           "smallest_volume_ratio"})
    std::printf("%-36s %9.4f\n", name, beat.feature.at(name));
  EXPECT_LE(beat.feature.at("beats"), 10);
  EXPECT_LE(beat.feature.at("beat_difference"), 0.01);
  EXPECT_GE(beat.feature.at("valve_switches"), 8);  // each of four valves opens and closes
  EXPECT_LE(beat.feature.at("valve_switches"), 20);
  EXPECT_LE(beat.feature.at("ringing_mmHg"), 0.2);
  // The loop's blood is conserved to rounding (circulation.cpp); cavities hold what it says they do.
  EXPECT_LE(beat.feature.at("blood_apart_mL"), 1e-4 * beat.feature.at("lv_edv_mL"));
  EXPECT_GE(beat.feature.at("smallest_volume_ratio"), 0.5);
}

TEST(HeartBeat, DoesNotDependOnItsNeighbour) {
  const std::vector<std::string> coarse = {at(6), "time.beats.at_most=1", "time.beats.length_ms=300"};
  const std::vector<std::pair<std::string, double>> other = {{"mechanics.twitch.peak_kPa", 150},
                                                             {"geometry.heart.lv_wall_mm", 11}};
  const std::vector<Beat> both = beat(coarse, other);
  const Beat alone = beat(coarse)[0];
  ASSERT_EQ(alone.recording.outcome, Outcome::done) << alone.recording.reason;
  EXPECT_EQ(both[0].recording.pressure, alone.recording.pressure);
  EXPECT_EQ(both[0].recording.volume, alone.recording.volume);
  ASSERT_EQ(both[1].recording.outcome, Outcome::done) << both[1].recording.reason;
  const std::size_t end_of_lv = alone.recording.volume.size() / 6 - 1;  // of six compartments
  EXPECT_GT(std::abs(both[1].recording.volume[end_of_lv] - alone.recording.volume[end_of_lv]), 1);
}

TEST(HeartBeat, HalvingTheSpacingChangesLittle) {
  if (!device().info().gpu) GTEST_SKIP() << "minutes on a CPU";
  const Beat coarse = beat({at(2)})[0], fine = beat({at(1)})[0];
  for (const char* name :
       {"lv_edv_mL", "lv_esv_mL", "lv_peak_mmHg", "rv_edv_mL", "rv_esv_mL", "rv_peak_mmHg"}) {
    std::printf("%-16s 2 mm %8.2f  1 mm %8.2f\n", name, coarse.feature.at(name), fine.feature.at(name));
    EXPECT_NEAR(coarse.feature.at(name), fine.feature.at(name), 0.05 * fine.feature.at(name)) << name;
  }
}

}  // namespace
}  // namespace cohort::test
