#include "ensemble/config.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "ensemble/csv_points.hpp"
#include "ensemble/identity.hpp"
#include "ensemble/places.hpp"
#include "ensemble/sha256.hpp"
#include "ensemble/suggest.hpp"
#include "solver/simulation.hpp"

namespace {

using cohort::Campaign;
using cohort::Distribution;
using cohort::parse_campaign;

const char* const slab = R"(
scene:
  geometry: {box: {size_mm: [20, 7, 3]}}
  grid: {dx_mm: 0.5}
  time: {end_ms: 1e2}
  precision: double
  stimuli:
    corner: {shape: box, lower_mm: [0, 0, 0], upper_mm: [+1.5, 1.5, 1.5], start_ms: 5, duration_ms: 2}
outputs:
  activation: {probes: {near_mm: [1, 1, 1], far_mm: [20, 7, 3]}}
)";

const char* const heart = R"(
scene:
  geometry: {heart: {lv_radius_mm: 26}}
  grid: {dx_mm: 4}
outputs: {ecg: {leads: 12, rate_hz: 500}}
parameters:
  geometry.heart.lv_wall_mm: {normal: [10, 1], bounds: [7, 14]}
  geometry.heart.lv_radius_mm: {uniform: [20, 30]}
campaign: {members: 9, method: grid, seed: 7, timeout_s: 600, retries: 1, members_per_device: 3}
store: results/heart.h5
)";

double value(const Campaign& campaign, const std::string& path) {
  return campaign.scene.parameters[campaign.scene.parameters.index(path)].value;
}

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

/// `text` with `from` replaced by `to`.
std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Config, IdentityIsNotTheLimitsNorTheSpelling) {
  const std::string text = heart, plain = parse_campaign(text, "heart.yaml").sha256;
  for (const char* set : {"store=b.h5", "campaign.timeout_s=60", "campaign.retries=3",
                          "campaign.members_per_device=2", "campaign.memory_limit_GB=1", "grid.dx_mm=4.0",
                          "campaign.seed=7", "outputs.ecg.rate_hz=5e2", "scene.precision=single"})
    EXPECT_EQ(parse_campaign(text, "heart.yaml", {set}).sha256, plain) << set;
  EXPECT_EQ(parse_campaign("# a comment" + text, "heart.yaml").sha256, plain);
  EXPECT_EQ(parse_campaign(with(text, "results/heart.h5", "elsewhere.h5"), "other.yaml").sha256, plain);
  EXPECT_EQ(parse_campaign(text, "heart.yaml", {"grid.dx_mm=2", "time.end_ms=10"}).sha256,
            parse_campaign(text, "heart.yaml", {"time.end_ms=10", "grid.dx_mm=2"}).sha256);
}

TEST(Config, IdentityIsWhatDeterminesTheResults) {
  const std::string plain = parse_campaign(heart, "heart.yaml").sha256;
  for (const char* set :
       {"campaign.seed=8", "campaign.members=4", "campaign.method=sobol", "grid.dx_mm=4.000000000000001",
        "precision=double", "torso.shape=box", "outputs.activation={}",
        "outputs.activation={probes: {a_mm: [0, 0, 0]}}", "stimuli.extra={site: sinoatrial_node}",
        "electrophysiology.regions.la.tau_close_ms=70", "outputs.pv={}",
        "outputs.displacement={points: {a_mm: [0, 0, 0]}}",
        "parameters.geometry.heart.lv_radius_mm={uniform: [20, 31]}",
        "parameters.geometry.heart.lv_radius_mm={log_uniform: [20, 30]}",
        "parameters.geometry.heart.lv_wall_mm={normal: [10, 1], bounds: [7, 13]}"})
    EXPECT_NE(parse_campaign(heart, "heart.yaml", {set}).sha256, plain) << set;
}

TEST(Config, IdentityHoldsMechanicsAndCirculation) {
  std::set<std::string> seen;
  for (const char* set :
       {"mechanics={}", "mechanics.law=neo_hookean", "mechanics.tension=none", "mechanics.cavities=[lv]",
        "mechanics.boundary={}", "mechanics.boundary={top: {surface: base, clamp: all}}",
        "mechanics.boundary={top: {surface: base, clamp: normal}}",
        "mechanics.boundary={top: {surface: base, spring: normal}}",
        "mechanics.boundary={top: {surface: epicardium, spring: normal}}", "circulation=none",
        "circulation.kind=windkessel", "time.beats={}", "time.beats.at_most=7"})
    EXPECT_TRUE(seen.insert(parse_campaign(heart, "heart.yaml", {"outputs.pv={}", set}).sha256).second)
        << set;
  // What no output needs does not count.
  EXPECT_EQ(parse_campaign(heart, "heart.yaml").sha256,
            parse_campaign(heart, "heart.yaml", {"mechanics.law=neo_hookean"}).sha256);
}

TEST(Config, IdentityNamesTheActivationOnce) {
  const std::string text =
      canonical_text(parse_campaign(heart, "heart.yaml", {"electrophysiology.activation=reaction_eikonal"}));
  const std::size_t first = text.find("activation by reaction_eikonal\n");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find("reaction_eikonal", first + 20), std::string::npos);
}

TEST(Config, IdentityHoldsTheShapes) {
  const std::string text = R"(
scene:
  geometry:
    shapes: {a: {ellipsoid: {}}, b: {ellipsoid: {}}, c: {subtract: [a, b]}}
    regions: {wall: {shape: c, fibres: none}, core: {shape: b}}
outputs: {activation: {}}
)";
  const std::string plain = parse_campaign(text, "shapes.yaml").sha256;
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"subtract", "union"},
                                                        {"[a, b]", "[b, a]"},
                                                        {"shape: b", "shape: a"},
                                                        {"fibres: none", "fibres: constant"},
                                                        {"shape: b", "shape: b, excitable: false"},
                                                        {"wall: {shape: c, fibres: none}, core: {shape: b}",
                                                         "core: {shape: b}, wall: {shape: c, fibres: none}"}})
    EXPECT_NE(parse_campaign(with(text, from, to), "shapes.yaml").sha256, plain) << to;
}

TEST(Config, IdentityHoldsThePointsButNotTheirPath) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "cohort_identity";
  std::filesystem::create_directories(folder);
  const auto sha256 = [&](const std::string& points, const std::string& rows) {
    std::ofstream(folder / points) << "geometry.heart.lv_wall_mm\n" << rows;
    return parse_campaign(
               "scene: {geometry: {heart: {}}}\noutputs: {ecg: {}}\n"
               "campaign: {method: csv, points: " +
                   points + "}\n",
               (folder / "csv.yaml").string())
        .sha256;
  };
  EXPECT_EQ(sha256("a.csv", "10\n"), sha256("b.csv", "10\n"));
  EXPECT_NE(sha256("a.csv", "10\n"), sha256("a.csv", "11\n"));
  std::filesystem::remove_all(folder);
}

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

TEST(Config, ReadsEveryFileOfConfigs) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(COHORT_SOURCE_DIR "/configs")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    EXPECT_NO_THROW(cohort::read_campaign(entry.path().string())) << entry.path();
  }
  EXPECT_GE(files, 4);
}

// The examples of FIPS 180-4 that NIST publishes with intermediate values, and the empty message.
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

TEST(Sha256, EqualsThePublishedDigests) {
  EXPECT_EQ(cohort::sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(cohort::sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(cohort::sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(cohort::sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
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
