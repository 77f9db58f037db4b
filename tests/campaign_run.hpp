#pragma once

#include <algorithm>
#include <stdexcept>

#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {

/// A file of configs/, with --set overrides.
inline Campaign campaign_of(const std::string& file, const std::vector<std::string>& overrides) {
  return read_campaign(std::string(COHORT_SOURCE_DIR) + "/configs/" + file, overrides);
}

/// The first member of a campaign file of the project, with --set overrides, simulated on the first device.
class CampaignRun {
 public:
  CampaignRun(const std::string& file, const std::vector<std::string>& overrides)
      : campaign_(read_campaign(std::string(COHORT_SOURCE_DIR) + "/" + file, overrides)),
        names_(layout(campaign_.scene).features) {
    const std::vector<Member> all = members(campaign_);
    const std::span<const Member> one(all.data(), 1);
    const Plan plan = make_plan(device(), campaign_.scene, one, {});
    Simulation simulation(device(), campaign_.scene, plan);
    recording_ = simulation.run(one, 600).front();
  }
  const Recording& recording() const { return recording_; }
  double feature(const std::string& name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) throw std::out_of_range("no feature " + name);
    return static_cast<double>(recording_.features[static_cast<std::size_t>(found - names_.begin())]);
  }

 private:
  Campaign campaign_;
  std::vector<std::string> names_;
  Recording recording_;
};

}  // namespace cohort::test
