// The ECG by lead fields against the ECG by a solve of the torso at every sample, over a beat of the default
// heart: two ways that share neither the grid of the torso, nor the transfer between heart and torso, nor
// what is solved for.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

// (leads, samples) mV of the heart of configs/ecg.yaml, coarse, in a torso a little smaller.
std::vector<float> ecg(const std::string& method, double torso_dx_mm, std::size_t& samples) {
  const auto number = [](const char* key, double value) {
    return key + std::string("=") + std::to_string(value);
  };
  const Campaign campaign = read_campaign(
      COHORT_SOURCE_DIR "/configs/ecg.yaml",
      {"grid.dx_mm=3", "time.end_ms=600", "scene.electrophysiology.activation=reaction_eikonal",
       "outputs.ecg.rate_hz=200", "torso.half_width_mm=140", "torso.half_depth_mm=120", "torso.lower_mm=-160",
       "torso.upper_mm=150", "outputs.ecg.method=" + method, number("torso.dx_mm", torso_dx_mm)});
  Member member{0, campaign.scene.parameters.values()};
  campaign.scene.parameters.resolve(member.values);
  const Plan plan = make_plan(device(), campaign.scene, {&member, 1}, {});
  Simulation simulation(device(), campaign.scene, plan);
  const Recording recording = std::move(simulation.run({&member, 1}, 600).front());
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  samples = layout(campaign.scene).ecg_ms.size();
  std::printf("%s, torso %.1f mm: %.1f s\n", method.c_str(), torso_dx_mm, recording.wall_s);
  return recording.ecg;
}

TEST(ForwardEcg, LeadFieldsGiveTheSame) {
  std::size_t samples = 0;
  const std::vector<float> forward = ecg("forward", 5, samples), lead_field = ecg("lead_field", 4, samples);
  ASSERT_EQ(forward.size(), lead_field.size());
  const std::vector<std::string> names = {"I",  "II", "III", "aVR", "aVL", "aVF",
                                          "V1", "V2", "V3",  "V4",  "V5",  "V6"};
  ASSERT_EQ(forward.size(), names.size() * samples);
  double all_difference = 0, all = 0;
  for (std::size_t lead = 0; lead < names.size(); ++lead) {
    double difference = 0, own = 0, largest = 0;
    for (std::size_t k = lead * samples; k < (lead + 1) * samples; ++k) {
      difference += std::pow(forward[k] - lead_field[k], 2);
      own += std::pow(forward[k], 2);
      largest = std::max<double>(largest, std::abs(forward[k]));
    }
    std::printf("%-4s RMS difference %.3f %%  (largest %.3f mV)\n", names[lead].c_str(),
                100 * std::sqrt(difference / own), largest);
    EXPECT_LT(std::sqrt(difference / own), 0.01) << names[lead];
    EXPECT_GT(largest, 0.05) << names[lead];  // there is a beat
    all_difference += difference;
    all += own;
  }
  std::printf("all  RMS difference %.3f %%\n", 100 * std::sqrt(all_difference / all));
  EXPECT_LT(std::sqrt(all_difference / all), 0.01);
}

}  // namespace
}  // namespace cohort::test
