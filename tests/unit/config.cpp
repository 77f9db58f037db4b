#include "ensemble/config.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "ensemble/places.hpp"
#include "ensemble/suggest.hpp"
#include "tests/campaign_texts.hpp"

namespace {

using cohort::Campaign;
using cohort::Distribution;
using cohort::parse_campaign;
using cohort::test::heart;
using cohort::test::slab;
using cohort::test::value;

TEST(Config, PutsNumbersAtTheirPaths) {
  const Campaign campaign = parse_campaign(slab, "slab.yaml");
  EXPECT_EQ(campaign.scene.geometry, cohort::GeometryKind::box);
  EXPECT_EQ(campaign.scene.precision, cohort::Precision::double_);
  EXPECT_EQ(value(campaign, "geometry.box.size_mm.x"), 20);
  EXPECT_EQ(value(campaign, "geometry.box.size_mm.z"), 3);
  EXPECT_EQ(value(campaign, "grid.dx_mm"), 0.5);
  EXPECT_EQ(value(campaign, "time.end_ms"), 100);
  EXPECT_EQ(value(campaign, "stimuli.corner.upper_mm.x"), 1.5);
  EXPECT_EQ(value(campaign, "stimuli.corner.start_ms"), 5);
  EXPECT_EQ(campaign.store, "slab.h5");
  EXPECT_EQ(campaign.members, 1);
}

TEST(Config, ReadsStimuliAndProbes) {
  const Campaign campaign = parse_campaign(slab, "slab.yaml");
  ASSERT_EQ(campaign.scene.stimuli.size(), 1u);
  EXPECT_EQ(campaign.scene.stimuli[0].name, "corner");
  EXPECT_EQ(campaign.scene.stimuli[0].kind, cohort::Stimulus::Kind::box);
  EXPECT_FALSE(campaign.scene.ecg);
  ASSERT_TRUE(campaign.scene.activation);
  EXPECT_EQ(campaign.scene.activation->probes, (std::vector<std::string>{"near", "far"}));
  EXPECT_EQ(value(campaign, "outputs.activation.probes.far_mm.y"), 7);
}

TEST(Config, ReadsTheCampaign) {
  const Campaign campaign = parse_campaign(heart, "configs/heart.yaml");
  EXPECT_TRUE(campaign.scene.ecg);
  EXPECT_FALSE(campaign.scene.activation);
  EXPECT_EQ(campaign.members, 9);
  EXPECT_EQ(campaign.method, cohort::Method::grid);
  EXPECT_EQ(campaign.seed, 7u);
  EXPECT_EQ(campaign.timeout_s, 600);
  EXPECT_EQ(campaign.retries, 1);
  EXPECT_EQ(campaign.members_per_device, 3);
  EXPECT_EQ(campaign.store, "results/heart.h5");
  ASSERT_EQ(campaign.parameters.size(), 2u);
  EXPECT_EQ(campaign.parameters[0].path, "geometry.heart.lv_wall_mm");
  const Distribution& wall = campaign.parameters[0].distribution;
  EXPECT_EQ(wall.kind, Distribution::Kind::normal);
  EXPECT_EQ(wall.a, 10);
  EXPECT_EQ(wall.b, 1);
  EXPECT_EQ(wall.lower, 7);
  EXPECT_EQ(wall.upper, 14);
  EXPECT_EQ(campaign.parameters[1].distribution.upper, 30);
}

TEST(Config, ReadsShapesAndRegions) {
  const Campaign campaign = parse_campaign(R"(
scene:
  geometry:
    shapes:
      outer: {ellipsoid: {centre_mm: [0, 0, 1]}}
      inner: {ellipsoid: {}}
      blend: {smooth_union: {of: [outer, inner], smoothing_mm: 6}}
      wall: {subtract: [blend, inner]}
    regions:
      muscle: {shape: wall, fibres: transmural}
      scar: {shape: inner, excitable: false}
outputs: {activation: {}}
)",
                                           "shapes.yaml");
  ASSERT_EQ(campaign.scene.shapes.size(), 4u);
  EXPECT_EQ(campaign.scene.shapes[3].kind, cohort::Shape::Kind::subtract);
  EXPECT_EQ(campaign.scene.shapes[3].operands, (std::vector<std::string>{"blend", "inner"}));
  ASSERT_EQ(campaign.scene.regions.size(), 2u);
  EXPECT_EQ(campaign.scene.regions[0].shape, "wall");
  EXPECT_EQ(campaign.scene.regions[0].fibres, cohort::Region::Fibres::transmural);
  EXPECT_FALSE(campaign.scene.regions[1].excitable);
  EXPECT_EQ(value(campaign, "geometry.shapes.outer.ellipsoid.centre_mm.z"), 1);
  EXPECT_EQ(value(campaign, "geometry.shapes.blend.smooth_union.smoothing_mm"), 6);
}

TEST(Config, LeavesInheritedParametersUnset) {
  const Campaign campaign = parse_campaign(R"(
scene:
  geometry: {heart: {}}
  electrophysiology: {mitchell_schaeffer: {tau_close_ms: 140}}
outputs: {ecg: {}}
)",
                                           "heart.yaml");
  const cohort::ParameterTable& table = campaign.scene.parameters;
  int inheriting = 0;
  for (const cohort::Parameter& parameter : table.all()) {
    if (parameter.inherits != "electrophysiology.mitchell_schaeffer.tau_close_ms") continue;
    ++inheriting;
    EXPECT_TRUE(std::isnan(parameter.value)) << parameter.path;
  }
  EXPECT_GT(inheriting, 0);
  std::vector<double> values = table.values();
  table.resolve(values);
  for (int i = 0; i < table.size(); ++i) {
    if (table[i].inherits != "electrophysiology.mitchell_schaeffer.tau_close_ms") continue;
    EXPECT_EQ(values[static_cast<size_t>(i)], 140);
  }
}

TEST(Config, ChecksATorsoThatNoOutputNeeds) {
  const std::string text = R"(
scene: {geometry: {heart: {}}, torso: {shape: ellipsoid, conductivity_mS_per_mm: 0.25}}
outputs: {activation: {}}
)";
  EXPECT_EQ(parse_campaign(text, "heart.yaml").scene.parameters.find("torso.conductivity_mS_per_mm"), -1);
  EXPECT_THROW(parse_campaign(text, "heart.yaml", {"torso.conductivity_mS_per_mm=-1"}), cohort::ConfigError);
}

TEST(Config, SetWins) {
  const Campaign campaign =
      parse_campaign(heart, "heart.yaml",
                     {"grid.dx_mm=2", "geometry.heart.rv_wall_mm=4.5", "campaign.members=4", "store=other.h5",
                      "outputs.ecg.rate_hz=250", "parameters.geometry.heart.lv_wall_mm={uniform: [8, 12]}",
                      "time.end_ms=10"});
  EXPECT_EQ(value(campaign, "grid.dx_mm"), 2);
  EXPECT_EQ(value(campaign, "geometry.heart.rv_wall_mm"), 4.5);
  EXPECT_EQ(value(campaign, "outputs.ecg.rate_hz"), 250);
  EXPECT_EQ(value(campaign, "time.end_ms"), 10);
  EXPECT_EQ(campaign.members, 4);
  EXPECT_EQ(campaign.store, "other.h5");
  ASSERT_EQ(campaign.parameters.size(), 2u);
  EXPECT_EQ(campaign.parameters[0].distribution.kind, Distribution::Kind::uniform);
}

TEST(Config, SetReachesAVectorAndItsComponents) {
  const Campaign campaign =
      parse_campaign(slab, "slab.yaml", {"geometry.box.size_mm.y=9", "stimuli.corner.upper_mm=[2, 3, 4]"});
  EXPECT_EQ(value(campaign, "geometry.box.size_mm.x"), 20);
  EXPECT_EQ(value(campaign, "geometry.box.size_mm.y"), 9);
  EXPECT_EQ(value(campaign, "stimuli.corner.upper_mm.z"), 4);
}

/// What the program tells of an exception with `message` once the campaign has been read.
std::string told(const Campaign& campaign, const std::string& message) {
  try {
    cohort::told_in_place(campaign, [&] { throw std::invalid_argument(message); });
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing";
}

TEST(Config, WhatIsRefusedLaterIsToldAtItsPlace) {
  const Campaign campaign = parse_campaign(heart, "heart.yaml", {"time.end_ms=5"});
  const auto expect = [&](const std::string& message, const std::string& place) {
    EXPECT_EQ(told(campaign, message), place + message);
  };
  expect("grid.dx_mm is too coarse", "heart.yaml:4:17: ");
  expect("outputs.ecg.method: forward needs grid.dx_mm", "heart.yaml:4:17: ");
  expect("no time.end_ms.", "--set:1: ");
  // At its default: the level that it would stand in.
  expect("outputs.ecg is short; torso.heart.roll_deg is odd", "heart.yaml:5:11: ");
  expect("geometry.heart.rv_wall_mm is thin", "heart.yaml:3:14: ");
  // What is no number too.
  expect("scene.geometry.heart.walls: thin", "");
  expect("geometry.heart.walls: thin", "heart.yaml:3:14: ");
  // Sampled: where its distribution stands.
  expect("geometry.heart.lv_wall_mm is thin", "heart.yaml:7:3: ");
  // Nothing of the file is named.
  expect("too little device memory: 3.5 bytes", "");
  expect("/tmp/grid.dx_mm/geometry.heart/time.end_ms: cannot be read", "");
  expect("time is short", "");
}

TEST(Config, TextIsTheFileAndItsOverrides) {
  const Campaign campaign =
      parse_campaign(heart, "heart.yaml", {"grid.dx_mm=2", "store=a.h5", "campaign.seed=8"});
  EXPECT_EQ(campaign.text, std::string(heart) + "# --set grid.dx_mm=2\n# --set campaign.seed=8\n");
}

TEST(Config, ReadsEveryFileOfConfigs) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(COHORT_SOURCE_DIR "/configs")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    EXPECT_NO_THROW(cohort::read_campaign(entry.path().string())) << entry.path();
  }
  EXPECT_GE(files, 4);
}

TEST(Suggest, CountsSwapsAsOne) {
  EXPECT_EQ(cohort::edit_distance("dt_ms", "dt_us"), 1);
  EXPECT_EQ(cohort::edit_distance("haert", "heart"), 1);
  EXPECT_EQ(cohort::edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(cohort::edit_distance("", "abc"), 3);
}

TEST(Suggest, NamesTheNearestOrAll) {
  EXPECT_EQ(cohort::suggestion("dt_us", {"end_ms", "dt_ms"}), "; did you mean \"dt_ms\"?");
  EXPECT_EQ(cohort::suggestion("tolerance", {"end_ms", "dt_ms"}), "; known are end_ms, dt_ms");
}

}  // namespace
