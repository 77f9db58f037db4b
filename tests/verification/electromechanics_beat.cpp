// A beat whose end is no whole number of windows or steps: tissue and loop take the same last steps, and
// cells march one beat, not another one after the last.
#include <gtest/gtest.h>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

TEST(ElectromechanicsBeat, EndsWhereItEnds) {
  const Campaign campaign =
      read_campaign(COHORT_SOURCE_DIR "/configs/heart.yaml",
                    {"electrophysiology.activation=reaction_eikonal", "mechanics.tension=nash_panfilov",
                     "mechanics.nash_panfilov.peak_kPa=150", "grid.dx_mm=6", "time.beats.at_most=1",
                     "time.beats.length_ms=333.33"});
  std::vector<Member> members(1, Member{0, campaign.scene.parameters.values()});
  campaign.scene.parameters.resolve(members[0].values);
  const Plan plan = make_plan(device(), campaign.scene, members, {});
  Simulation simulation(device(), campaign.scene, plan);
  const Recording recording = simulation.run(members, 3600)[0];
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  std::int64_t steps = 0;
  for (const KernelPerformance& kernel : simulation.performance())
    if (kernel.kernel == "monodomain_step") steps = kernel.calls;
  EXPECT_EQ(steps, plan.steps);
}

}  // namespace
}  // namespace cohort::test
