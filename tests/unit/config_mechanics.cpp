// What a campaign file says of mechanics and circulation.
#include <gtest/gtest.h>

#include <cmath>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/campaign_texts.hpp"

namespace {

using cohort::Campaign;
using cohort::parse_campaign;
using cohort::test::value;

/// The scene of a heart whose sections and outputs are these.
cohort::Scene heart_with(const std::string& sections, const std::string& outputs = "pv: {}") {
  return parse_campaign("scene:\n  geometry: {heart: {}}\n" + sections + "outputs: {" + outputs + "}\n",
                        "heart.yaml")
      .scene;
}

TEST(Config, TheHeartBeatsUnlessToldOtherwise) {
  using Kind = cohort::Mechanics::Boundary::Kind;
  const cohort::Scene scene = heart_with("");
  ASSERT_TRUE(scene.pv && scene.mechanics && scene.circulation);
  EXPECT_FALSE(scene.beats);
  EXPECT_EQ(scene.circulation->kind, cohort::Circulation::Kind::closed_loop);
  EXPECT_EQ(scene.mechanics->law, "guccione");
  EXPECT_EQ(scene.mechanics->tension, "twitch");
  ASSERT_EQ(scene.mechanics->cavities.size(), 2u);
  EXPECT_EQ(scene.mechanics->cavities[1].name, "rv");
  ASSERT_EQ(scene.mechanics->boundary.size(), 3u);
  EXPECT_EQ(scene.mechanics->boundary[0].kind, Kind::clamp_normal);
  EXPECT_EQ(scene.mechanics->boundary[2].surface, "epicardium");
  EXPECT_EQ(scene.mechanics->boundary[2].kind, Kind::spring_normal);
  EXPECT_GE(scene.parameters.find("outputs.pv.rate_hz"), 0);
}

TEST(Config, AHeartWithoutPressuresHasNoMechanics) {
  for (const char* sections :
       {"",
        "  mechanics: {law: neo_hookean}\n  circulation: {systemic: {arterial_compliance_mL_per_mmHg: 1}}\n",
        "  time: {beats: {at_most: 3}}\n"}) {
    const cohort::Scene scene = heart_with(sections, "ecg: {}");
    EXPECT_FALSE(scene.mechanics || scene.circulation || scene.beats) << sections;
    for (const cohort::Parameter& parameter : scene.parameters.all())
      EXPECT_FALSE(parameter.path.starts_with("mechanics.") || parameter.path.starts_with("circulation.") ||
                   parameter.path.starts_with("time.beat"))
          << parameter.path;
  }
}

TEST(Config, ReadsTheMechanicsOfAHeart) {
  using Kind = cohort::Mechanics::Boundary::Kind;
  const cohort::Scene scene = heart_with(R"(
  mechanics:
    law: neo_hookean
    tension: none
    cavities: [lv]
    boundary: {top: {surface: base, clamp: all}, wall: {surface: epicardium, spring: full}}
    quasi_static: true
  circulation: none
)",
                                         "displacement: {points: {apex_mm: [0, 0, -60]}}");
  EXPECT_FALSE(scene.circulation);
  ASSERT_TRUE(scene.mechanics && scene.displacement);
  EXPECT_EQ(scene.mechanics->law, "neo_hookean");
  EXPECT_EQ(scene.mechanics->tension, "");
  ASSERT_EQ(scene.mechanics->cavities.size(), 1u);
  ASSERT_EQ(scene.mechanics->boundary.size(), 2u);
  EXPECT_EQ(scene.mechanics->boundary[0].name, "top");
  EXPECT_EQ(scene.mechanics->boundary[0].kind, Kind::clamp);
  EXPECT_EQ(scene.mechanics->boundary[1].kind, Kind::spring);
  EXPECT_TRUE(scene.mechanics->quasi_static);
  EXPECT_EQ(scene.displacement->points, std::vector<std::string>{"apex"});
  EXPECT_EQ(scene.parameters.value("outputs.displacement.points.apex_mm.z"), -60);
}

// Numbers alone change a default condition, with a surface the map replaces the defaults.
TEST(Config, NumbersChangeADefaultCondition) {
  using Kind = cohort::Mechanics::Boundary::Kind;
  const std::string stiffness = "mechanics.boundary.epicardium.stiffness_kPa_per_mm";
  const cohort::Scene alone =
      heart_with("\n  mechanics: {boundary: {epicardium: {stiffness_kPa_per_mm: 0.2}}}\n");
  ASSERT_EQ(alone.mechanics->boundary.size(), 3u);
  EXPECT_EQ(alone.parameters.value(stiffness), 0.2);
  const cohort::Scene both = heart_with(
      "\n  mechanics: {boundary: {epicardium: {stiffness_kPa_per_mm: 0.3}, top: {surface: base, clamp: "
      "all}}}\n");
  ASSERT_EQ(both.mechanics->boundary.size(), 2u);
  EXPECT_EQ(both.mechanics->boundary[0].surface, "epicardium");
  EXPECT_EQ(both.mechanics->boundary[0].kind, Kind::spring_normal);
  EXPECT_EQ(both.parameters.value(stiffness), 0.3);
}

// Regions whose walls do not deform have no numbers of the mechanics.
TEST(Config, OnlyWallsThatDeformHaveMaterials) {
  const auto known = [](const cohort::Scene& scene, const std::string& region) {
    return scene.parameters.find("mechanics.regions." + region + ".peak_kPa") >= 0;
  };
  const cohort::Scene ventricles = heart_with("");
  EXPECT_TRUE(known(ventricles, "lv") && known(ventricles, "rv"));
  for (const char* region : {"la", "ra", "bachmann", "insulator", "aorta"})
    EXPECT_FALSE(known(ventricles, region)) << region;
  const cohort::Scene left = heart_with("\n  mechanics: {cavities: [lv, la]}\n");
  EXPECT_TRUE(known(left, "la"));
  EXPECT_FALSE(known(left, "ra") || known(left, "bachmann"));
}

TEST(Config, ReadsTheMechanicsOfShapes) {
  const Campaign campaign = parse_campaign(R"(
scene:
  geometry:
    shapes: {outer: {ellipsoid: {}}, inner: {ellipsoid: {}}, wall: {subtract: [outer, inner]}}
    regions: {wall: {shape: wall}}
  mechanics:
    cavities: {hollow: {shape: inner}}
outputs: {pv: {rate_hz: 500}}
)",
                                           "shapes.yaml");
  const cohort::Scene& scene = campaign.scene;
  ASSERT_TRUE(scene.mechanics);
  EXPECT_FALSE(scene.circulation);
  EXPECT_EQ(scene.mechanics->tension, "");
  EXPECT_TRUE(scene.mechanics->boundary.empty());
  EXPECT_EQ(scene.mechanics->cavities[0].shape, "inner");
  EXPECT_EQ(value(campaign, "outputs.pv.rate_hz"), 500);
  EXPECT_EQ(cohort::layout(scene).compartments, std::vector<std::string>{"hollow"});
}

TEST(Config, ACirculationStandsAloneWithoutAGeometry) {
  for (const char* geometry : {"geometry: none, ", ""}) {
    const Campaign campaign =
        parse_campaign("scene: {" + std::string(geometry) +
                           "circulation: {kind: windkessel}, time: {beats: {at_most: 4}}}\n"
                           "outputs: {pv: {rate_hz: 300}}\n",
                       "circulation.yaml", {"time.beats.length_ms=900"});
    const cohort::Scene& scene = campaign.scene;
    EXPECT_EQ(scene.geometry, cohort::GeometryKind::none);
    ASSERT_TRUE(scene.circulation && scene.beats);
    EXPECT_EQ(scene.circulation->kind, cohort::Circulation::Kind::windkessel);
    EXPECT_EQ(scene.parameters.find("grid.dx_mm"), -1);
    const cohort::Layout layout = cohort::layout(scene);
    EXPECT_EQ(layout.compartments, (std::vector<std::string>{"LV", "aorta"}));
    ASSERT_EQ(layout.pv_ms.size(), 270u);  // 900 ms at 300 Hz
    EXPECT_EQ(layout.pv_ms[0], 0);
    EXPECT_NEAR(layout.pv_ms[3], 10, 1e-12);
  }
}

}  // namespace
