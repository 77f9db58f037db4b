// A heart's beat by two ways that share no code between the cells and the tissue: behind arrival times, by
// templates of single cells, and with the cells' own potential in windows of time. What differs is diffusion,
// which smooths the front and repolarisation, and the triggered upstroke.
#include <cstdio>
#include <map>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

std::map<std::string, double> beat(const std::string& activation, const std::string& tension,
                                   std::vector<std::string> changes = {}) {
  changes.insert(changes.end(), {"electrophysiology.activation=" + activation, "mechanics.tension=" + tension,
                                 "grid.dx_mm=6", "time.beats.at_most=1"});
  const Campaign campaign = read_campaign(COHORT_SOURCE_DIR "/configs/heart.yaml", changes);
  std::vector<Member> members(1, Member{0, campaign.scene.parameters.values()});
  campaign.scene.parameters.resolve(members[0].values);
  const Plan plan = make_plan(device(), campaign.scene, members, {});
  Simulation simulation(device(), campaign.scene, plan);
  const Recording recording = simulation.run(members, 3600)[0];
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  std::map<std::string, double> result;
  const std::vector<std::string> names = layout(campaign.scene).features;
  for (std::size_t k = 0; k < names.size(); ++k)
    result[names[k]] = static_cast<double>(recording.features[k]);
  return result;
}

void expect_alike(const std::map<std::string, double>& a, const std::map<std::string, double>& b,
                  double least_sv_mL) {
  for (const char* name :
       {"lv_edv_mL", "lv_esv_mL", "lv_peak_mmHg", "rv_edv_mL", "rv_esv_mL", "rv_peak_mmHg"}) {
    std::printf("%s: %.3f behind arrival times, %.3f with the time loop\n", name, a.at(name), b.at(name));
    EXPECT_NEAR(b.at(name), a.at(name), 0.01 * a.at(name)) << name;
  }
  EXPECT_GT(a.at("lv_sv_mL"), least_sv_mL);
}

TEST(ElectromechanicsHeart, PotentialInWindowsIsThatOfTemplates) {
  const std::vector<std::string> stronger = {"mechanics.nash_panfilov.peak_kPa=150"};
  expect_alike(beat("eikonal", "nash_panfilov", stronger),
               beat("reaction_eikonal", "nash_panfilov", stronger), 30);
}

TEST(ElectromechanicsHeart, RecordedActivationTimesAreTheArrivals) {
  expect_alike(beat("eikonal", "twitch"), beat("reaction_eikonal", "twitch"), 30);
}

}  // namespace
}  // namespace cohort::test
