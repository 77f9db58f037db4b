#pragma once

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

// The beating heart of a file of configs/, and what is normal in healthy adults
// (tests/reference/physiology.yaml).
namespace cohort::test {

struct Beat {
  Recording recording;
  std::map<std::string, double> feature;
};

/// changes: as of --set. others: those of a second member.
inline std::vector<Beat> beat(const std::vector<std::string>& changes,
                              const std::vector<std::pair<std::string, double>>& others = {},
                              const std::string& file = "heart.yaml") {
  const Campaign campaign = read_campaign(COHORT_SOURCE_DIR "/configs/" + file, changes);
  const Scene& scene = campaign.scene;
  std::vector<Member> members(1, Member{0, scene.parameters.values()});
  if (!others.empty()) {
    members.push_back({1, members[0].values});
    for (const auto& [path, value] : others)
      members[1].values[static_cast<size_t>(scene.parameters.index(path))] = value;
  }
  for (Member& member : members) scene.parameters.resolve(member.values);
  PlanOptions options;
  options.members_per_device = static_cast<int>(members.size());
  const Plan plan = make_plan(device(), scene, members, options);
  Simulation simulation(device(), scene, plan);
  std::vector<Beat> beats;
  for (Recording& recording : simulation.run(members, 3600)) {
    Beat& one = beats.emplace_back();
    const std::vector<std::string> names = layout(scene).features;
    for (size_t k = 0; k < names.size(); ++k)
      one.feature[names[k]] = static_cast<double>(recording.features[k]);
    one.recording = std::move(recording);
  }
  return beats;
}

inline std::string at(double dx_mm) {
  return "grid.dx_mm=" + std::to_string(dx_mm);
}
inline double spacing() {
  return device().info().gpu ? 2 : 4;
}

inline void expect_healthy(const Beat& beat) {
  const YAML::Node ranges = YAML::LoadFile(COHORT_SOURCE_DIR "/tests/reference/physiology.yaml");
  ASSERT_GE(ranges.size(), 23u);
  for (const auto& range : ranges) {
    const auto name = range.first.as<std::string>();
    ASSERT_TRUE(beat.feature.contains(name)) << name;
    const double value = beat.feature.at(name);
    std::printf("%-36s %9.2f  [%g, %g]\n", name.c_str(), value, range.second[0].as<double>(),
                range.second[1].as<double>());
    EXPECT_GE(value, range.second[0].as<double>()) << name;
    EXPECT_LE(value, range.second[1].as<double>()) << name;
  }
}

}  // namespace cohort::test
