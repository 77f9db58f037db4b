#pragma once

#include "tests/campaign_run.hpp"

namespace cohort::test {

/// Apex of Land's ellipsoid at rest under its loads, mm in the benchmark's frame.
struct Apex {
  double endocardium, epicardium, volume_mL, pressure_mmHg;
};

/// Runs configs/land_<problem>.yaml.
inline Apex land(const std::string& problem, double dx_mm, std::vector<std::string> overrides = {}) {
  overrides.push_back("grid.dx_mm=" + std::to_string(dx_mm));
  const CampaignRun run("configs/land_" + problem + ".yaml", overrides);
  const Recording& recording = run.recording();
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  // (points, 3, one sample); the apices are the first two points, at -17 and -20 mm before any load.
  EXPECT_EQ(recording.displacement.size() % 3, 0u);
  return {-17 + static_cast<double>(recording.displacement.at(2)),
          -20 + static_cast<double>(recording.displacement.at(5)),
          static_cast<double>(recording.volume.at(0)), static_cast<double>(recording.pressure.at(0))};
}

/// Whether the finer of two grids has the apices of problem 2 within a share of themselves, and comes from
/// above.
inline void expect_published_inflation(const Apex& coarse, const Apex& fine, double share) {
  EXPECT_NEAR(fine.endocardium, -26.533, share * 26.533);
  EXPECT_NEAR(fine.epicardium, -28.179, share * 28.179);
  EXPECT_LT(fine.endocardium, coarse.endocardium);
  EXPECT_LT(fine.epicardium, coarse.epicardium);
  EXPECT_LT(coarse.volume_mL, fine.volume_mL);
}

/// Whether the finer of two grids has the apices of problem 3 within a share of the nearer end of their
/// ranges, and is the better one.
inline void expect_published_contraction(const Apex& coarse, const Apex& fine, double share) {
  EXPECT_GT(fine.endocardium, -12.5 * (1 + share));
  EXPECT_LT(fine.endocardium, -11.99 * (1 - share));
  EXPECT_GT(fine.epicardium, -15.5 * (1 + share));
  EXPECT_LT(fine.epicardium, -15.22 * (1 - share));
  EXPECT_LT(fine.endocardium, coarse.endocardium);
  EXPECT_GT(fine.epicardium, coarse.epicardium);
}

}  // namespace cohort::test
