// The beating heart of configs/heart.yaml against what is normal in healthy adults
// (tests/reference/physiology.yaml): at 4 mm on a CPU, at 2 mm with the halved spacing on a GPU.
#include "tests/heart_run.hpp"

namespace cohort::test {
namespace {

TEST(HeartBeat, IsThatOfAHealthyAdult) {
  const Beat beat = test::beat({at(spacing())})[0];
  ASSERT_EQ(beat.recording.outcome, Outcome::done) << beat.recording.reason;
  expect_healthy(beat);
  for (const char* name :
       {"beats", "beat_difference", "valve_switches", "ringing_mmHg", "blood_apart_mL",
        "smallest_volume_ratio", "active_work_mJ", "lv_work_on_blood_mJ", "rv_work_on_blood_mJ",
        "stored_energy_change_mJ", "dissipated_energy_mJ", "energy_residual"})
    std::printf("%-36s %9.4f\n", name, beat.feature.at(name));
  EXPECT_LE(beat.feature.at("beats"), 10);
  EXPECT_LE(beat.feature.at("beat_difference"), 0.01);
  EXPECT_GE(beat.feature.at("valve_switches"), 8);  // each of four valves opens and closes
  EXPECT_LE(beat.feature.at("valve_switches"), 20);
  EXPECT_LE(beat.feature.at("ringing_mmHg"), 0.2);
  // The loop's blood is conserved to rounding (circulation.cpp); cavities hold what it says they do.
  EXPECT_LE(beat.feature.at("blood_apart_mL"), 1e-4 * beat.feature.at("lv_edv_mL"));
  EXPECT_GE(beat.feature.at("smallest_volume_ratio"), 0.5);
  EXPECT_LT(std::abs(beat.feature.at("energy_residual")), 0.01);
  // The works at every step of the tissue are those of the recorded loops.
  for (const char* ventricle : {"lv", "rv"}) {
    const std::string name = ventricle;
    const double loop = beat.feature.at(name + "_stroke_work_mJ");
    EXPECT_NEAR(beat.feature.at(name + "_work_on_blood_mJ"), loop, 0.01 * loop) << name;
  }
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

TEST(HeartBeat, LeavesNothingToTheNextBatch) {
  const Campaign campaign =
      read_campaign(COHORT_SOURCE_DIR "/configs/heart.yaml",
                    {at(6), "time.beats.at_most=1", "time.beats.length_ms=300", "torso.dx_mm=20"});
  const Scene& scene = campaign.scene;
  std::vector<Member> members(3, Member{0, scene.parameters.values()});
  const auto change = [&](std::size_t m, const std::string& path, double value) {
    members[m].values[static_cast<std::size_t>(scene.parameters.index(path))] = value;
  };
  change(0, "geometry.heart.lv_wall_mm", 12);
  change(1, "circulation.valves.aortic.closed_resistance_mmHg_s_per_mL", 0.5);  // leaks
  change(1, "mechanics.twitch.peak_kPa", 3000);                                 // ends as unstable
  for (Member& member : members) scene.parameters.resolve(member.values);
  PlanOptions options;
  options.members_per_device = 2;
  const Plan plan = make_plan(device(), scene, members, options);
  Simulation used(device(), scene, plan), fresh(device(), scene, plan);
  const std::vector<Recording> before = used.run(std::span(members).first(2), 600);
  EXPECT_EQ(before[0].outcome, Outcome::done) << before[0].reason;
  EXPECT_EQ(before[1].outcome, Outcome::unstable);
  const std::span<const Member> last(&members[2], 1);
  const Recording second = used.run(last, 600)[0], first = fresh.run(last, 600)[0];
  ASSERT_EQ(first.outcome, Outcome::done) << first.reason;
  EXPECT_NE(first.pressure, before[0].pressure);
  const auto same = [](const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](float x, float y) {
             return x == y || (std::isnan(x) && std::isnan(y));
           });
  };
  EXPECT_TRUE(same(second.pressure, first.pressure));
  EXPECT_TRUE(same(second.volume, first.volume));
  EXPECT_TRUE(same(second.features, first.features));
}

TEST(HeartBeat, HalvingTheSpacingChangesLittle) {
  if (!device().info().gpu) GTEST_SKIP() << "minutes on a CPU";
  const Beat coarse = beat({at(2)})[0], fine = beat({at(1), "mechanics.dx_mm=0"})[0];
  for (const char* name :
       {"lv_edv_mL", "lv_esv_mL", "lv_peak_mmHg", "rv_edv_mL", "rv_esv_mL", "rv_peak_mmHg"}) {
    std::printf("%-16s 2 mm %8.2f  1 mm %8.2f\n", name, coarse.feature.at(name), fine.feature.at(name));
    EXPECT_NEAR(coarse.feature.at(name), fine.feature.at(name), 0.05 * fine.feature.at(name)) << name;
  }
}

}  // namespace
}  // namespace cohort::test
