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

}  // namespace cohort::test
