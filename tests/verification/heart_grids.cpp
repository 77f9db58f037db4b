// Tissue that deforms on a coarser grid than the wave travels on, and a ventricle of tissue before a
// windkessel.
#include <cmath>
#include <cstdio>

#include "tests/campaign_run.hpp"
#include "tests/excited_solid.hpp"

namespace cohort::test {
namespace {

const std::string pressure_alone = "outputs={pv: {rate_hz: 1000}}", one_beat = "time.beats.at_most=1",
                  shorter = "time.beats.length_ms=650";

TEST(HeartGrids, CoarserMechanicsBeatAlike) {
  const CampaignRun both("configs/heart.yaml", {"grid.dx_mm=6", one_beat, shorter, pressure_alone});
  const CampaignRun two_to_one("configs/heart.yaml",
                               {"grid.dx_mm=3", "mechanics.dx_mm=6", one_beat, shorter, pressure_alone});
  ASSERT_EQ(both.recording().outcome, Outcome::done) << both.recording().reason;
  ASSERT_EQ(two_to_one.recording().outcome, Outcome::done) << two_to_one.recording().reason;
  for (const char* name : {"lv_edv_mL", "lv_esv_mL", "lv_ef_percent", "lv_peak_mmHg", "rv_edv_mL",
                           "rv_esv_mL", "rv_ef_percent", "rv_peak_mmHg"}) {
    std::printf("%-16s 6 mm %8.2f  wave on 3 mm %8.2f\n", name, both.feature(name), two_to_one.feature(name));
    EXPECT_NEAR(two_to_one.feature(name), both.feature(name), 0.02 * both.feature(name)) << name;
  }
}

// Times that are a coordinate (mm) come back at the centres of the deforming cells.
TEST(HeartGrids, ActivationIsBroughtOver) {
  for (const auto& [wave, tissue] : {std::pair(3., 6.), std::pair(4., 6.)}) {
    const Campaign campaign = read_campaign(
        COHORT_SOURCE_DIR "/configs/heart.yaml",
        {"grid.dx_mm=" + std::to_string(wave), "mechanics.dx_mm=" + std::to_string(tissue), pressure_alone});
    const ExcitedSolid heart(campaign.scene);
    const Solid& solid = heart.solid;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      constexpr float offset = 1000;  // times below 0 are none
      const Tissue& excited = heart.excitation.tissue;
      std::vector<float> times(static_cast<std::size_t>(excited.stride), -1);
      for (std::size_t i = 0; i < times.size(); ++i)
        if (excited.regions[i] != 255) times[i] = offset + static_cast<float>(excited.centre(i)[axis]);
      const std::vector<float> brought = heart.brought_over(times);
      std::size_t cells = 0, near = 0;
      double most = 0;
      for (std::size_t i = 0; i < brought.size(); ++i) {
        if (solid.mesh().grid_cell[i] < 0) continue;
        ASSERT_GE(brought[i], 0) << "cell " << i;
        const double apart = std::abs(static_cast<double>(brought[i] - offset) - solid.centre(i)[axis]);
        ++cells;
        near += apart < 0.51 * wave;
        most = std::max(most, apart);
      }
      const double share = static_cast<double>(near) / static_cast<double>(cells);
      std::printf(
          "wave %.0f mm, tissue %.0f mm: %.1f %% of %zu cells within half a cell, all within %.1f mm\n", wave,
          tissue, 100 * share, cells, most);
      EXPECT_GT(share, 0.9);  // others: at the surface, where the finer grid has a cell and the other none
      EXPECT_LT(most, 1.5 * std::max(wave, tissue));
    }
  }
}

}  // namespace
}  // namespace cohort::test
