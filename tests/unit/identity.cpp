// The identity of a campaign: what determines its results.
#include "ensemble/identity.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "ensemble/config.hpp"
#include "ensemble/sha256.hpp"
#include "tests/campaign_texts.hpp"

namespace {

using cohort::Campaign;
using cohort::parse_campaign;
using cohort::test::heart;
using cohort::test::slab;

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

// The examples of FIPS 180-4 that NIST publishes with intermediate values, and the empty message.
TEST(Sha256, EqualsThePublishedDigests) {
  EXPECT_EQ(cohort::sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(cohort::sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(cohort::sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(cohort::sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace
