#include "ensemble/csv_points.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/campaign_texts.hpp"

namespace {

using cohort::Campaign;
using cohort::parse_campaign;
using cohort::test::slab;

TEST(Config, PointsOfACsvCountTheMembers) {
  std::filesystem::current_path(COHORT_SOURCE_DIR);
  const std::string text = R"(
scene: {geometry: {heart: {}}}
outputs: {ecg: {}}
campaign: {method: csv, points: points.csv}
)";
  const Campaign campaign = parse_campaign(text, "tests/unit/csv.yaml");
  EXPECT_EQ(campaign.members, 3);
  EXPECT_EQ(campaign.points_file, "tests/unit/points.csv");
  EXPECT_NE(campaign.text.find("# points points.csv sha256 "), std::string::npos);
}

TEST(CsvPoints, MoreRowsThanACampaignHoldsAreRefused) {
  const Campaign campaign = parse_campaign(slab, "slab.yaml");
  const std::string file = (std::filesystem::path(testing::TempDir()) / "many_rows.csv").string();
  std::ofstream(file) << "stimuli.corner.start_ms\n1\n2\n# not a row\n3\n\n";
  EXPECT_EQ(cohort::read_csv_points(file, campaign.scene.parameters, 3).rows, 3u);
  EXPECT_EQ(cohort::read_csv_points(file, campaign.scene.parameters).rows, 3u);
  try {
    cohort::read_csv_points(file, campaign.scene.parameters, 2);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(error.what(), file +
                                ":5: more than 2 rows (the host holds every member's parameters in memory); "
                                "split the campaign");
  }
  std::filesystem::remove(file);
}

}  // namespace
