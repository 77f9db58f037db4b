// A left ventricle of tissue before a windkessel.
#include <cmath>
#include <cstdio>

#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

TEST(HeartWindkessel, BeatsPeriodically) {
  const CampaignRun run("configs/windkessel.yaml",
                        {"grid.dx_mm=6", "mechanics.dx_mm=0", "time.beats.until_periodic=0.03"});
  ASSERT_EQ(run.recording().outcome, Outcome::done) << run.recording().reason;
  for (const char* name : {"lv_edv_mL", "lv_esv_mL", "lv_ef_percent", "lv_peak_mmHg", "lv_edp_mmHg",
                           "aorta_mean_mmHg", "cardiac_output_L_per_min", "beats", "beat_difference",
                           "valve_switches", "ringing_mmHg", "blood_apart_mL", "energy_residual"})
    std::printf("%-26s %9.4f\n", name, run.feature(name));
  EXPECT_LE(run.feature("beat_difference"), 0.03);
  EXPECT_LT(run.feature("beats"), 15);
  EXPECT_LE(run.feature("valve_switches"), 20);
  EXPECT_LE(run.feature("ringing_mmHg"), 0.2);
  EXPECT_LE(run.feature("blood_apart_mL"), 0.01);
  EXPECT_LT(std::abs(run.feature("energy_residual")), 0.01);
  EXPECT_GT(run.feature("lv_ef_percent"), 45);
  EXPECT_LT(run.feature("lv_ef_percent"), 70);
  // Mean flow through the peripheral resistance, from the mean pressure behind the impedance of
  // the root; filling to the pressure behind the valve.
  const double resistance = 0.85, characteristic = 0.03, venous = 5, filling = 9;
  const double flow = run.feature("cardiac_output_L_per_min") * 1000 / 60;  // mL/s
  EXPECT_NEAR(run.feature("aorta_mean_mmHg"), venous + (resistance + characteristic) * flow, 2);
  EXPECT_NEAR(run.feature("lv_edp_mmHg"), filling, 0.3);
}

}  // namespace
}  // namespace cohort::test
