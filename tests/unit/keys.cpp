// The page of all keys (configs/keys.md) beside what the reader of campaign files looks for.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "ensemble/config.hpp"
#include "ensemble/key_reference.hpp"

namespace cohort {
namespace {

std::string contents(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Every campaign of configs/, and almost every one of tests/bad_configs, whose mistakes reach the rarer
/// keys.
std::vector<std::filesystem::path> campaigns() {
  std::vector<std::filesystem::path> files;
  for (const char* folder : {"configs", "tests/bad_configs"})
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (entry.path().extension() == ".yaml" &&
          entry.path().filename() != "bad_name.yaml")  // a dot in a name
        files.push_back(entry.path());
  return files;
}

/// All levels that have structure, for those that no file has.
const char* const every_level = R"(
scene:
  geometry:
    shapes: {a: {box: {}}, b: {ellipsoid: {}}, c: {union: [a, b]}, d: {smooth_union: {of: [a, b]}}, e: {shell: {of: a}}}
    regions: {r: {shape: a, bath: false, fibres: none, excitable: true}}
  electrophysiology:
    conduction_system: {early_sites: {mine: {surface: lv}}}
  stimuli: {s: {shape: box}, t: {site: sinoatrial_node}}
  torso: {shape: box}
  mechanics: {law: guccione, cavities: {lv: {shape: a}}, boundary: {top: {surface: b, spring: full}}}
  circulation: {kind: closed_loop}
  time: {beats: {}}
outputs: {ecg: {}, activation: {probes: {p_mm: [0, 0, 0]}}, pv: {}, displacement: {points: {p_mm: [0, 0, 0]}}}
parameters:
  grid.dx_mm: {uniform: [1, 2]}
  geometry.shapes.a.box.size_mm.x: {uniform: [1, 2]}
campaign: {members: 2}
accuracy: {lv_ef: 1 %, measurements: nowhere.yaml}
)";

class Keys : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::current_path(COHORT_SOURCE_DIR); }
  static std::set<std::string> looked_for() {
    std::set<std::string> keys = keys_looked_for(every_level, "configs/every_level.yaml");
    for (const auto& file : campaigns()) keys.merge(keys_looked_for(contents(file), file.string()));
    return keys;
  }
};

TEST_F(Keys, EveryKeyThatTheReaderLooksForIsOnThePage) {
  const std::set<std::string> keys = looked_for();
  EXPECT_GT(keys.size(), 100u);
  for (const std::string& key : keys) EXPECT_TRUE(is_documented(key)) << key;
}

TEST_F(Keys, EveryKeyOnThePageIsLookedFor) {
  std::set<std::string> patterns;
  for (const std::string& key : looked_for()) patterns.insert(key_pattern(key));
  for (const StructureKey& key : structure_keys()) EXPECT_TRUE(patterns.contains(key.path)) << key.path;
}

TEST_F(Keys, EveryParameterOfEveryCampaignIsOnThePage) {
  for (const auto& entry : std::filesystem::directory_iterator("configs")) {
    if (entry.path().extension() != ".yaml") continue;
    const Campaign campaign = read_campaign(entry.path().string());
    for (const Parameter& parameter : campaign.scene.parameters.all())
      EXPECT_TRUE(is_documented(parameter.path)) << parameter.path;
  }
  EXPECT_FALSE(is_documented("grid.dy_mm"));
  EXPECT_FALSE(is_documented("electrophysiology.regions.lv.tau_closed_ms"));
  EXPECT_FALSE(is_documented("stimuli.pace.start_s"));
}

TEST_F(Keys, ThePageIsWhatTheProgramPrints) {
  EXPECT_TRUE(contents("configs/keys.md") == key_reference())
      << "configs/keys.md is out of date: build/cohort keys > configs/keys.md";
}

}  // namespace
}  // namespace cohort
