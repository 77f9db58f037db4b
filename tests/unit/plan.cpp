// What a plan states beside what then runs.
#include <chrono>
#include <thread>

#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "ensemble/plan_campaign.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

Campaign campaign_of(const std::string& file, const std::vector<std::string>& overrides) {
  return read_campaign(std::string(COHORT_SOURCE_DIR) + "/configs/" + file, overrides);
}

/// Bytes allocated once no more are given back: a driver may free a buffer a little after its last command.
std::size_t settled_bytes() {
  device().queue().finish();
  for (std::size_t bytes = device().allocated_bytes();;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const std::size_t now = device().allocated_bytes();
    if (now == bytes) return now;
    bytes = now;
  }
}

/// Bytes of the device that a campaign's own values take in a run, over those that the plan states.
double taken_of_stated(const std::string& file, const std::vector<std::string>& overrides,
                       ActivationMethod method) {
  const Campaign campaign = campaign_of(file, overrides);
  Member member{0, campaign.scene.parameters.values()};
  campaign.scene.parameters.resolve(member.values);
  const std::span<const Member> one(&member, 1);
  make_plan(device(), campaign.scene, one, {});  // what a device keeps for good is there behind the first
  const std::size_t before = settled_bytes();
  const Plan plan = make_plan(device(), campaign.scene, one, {});
  EXPECT_EQ(plan.activation, method);
  EXPECT_EQ(settled_bytes(), before);
  Simulation simulation(device(), campaign.scene, plan);
  EXPECT_EQ(simulation.run(one, 600).front().outcome, Outcome::done);
  return static_cast<double>(device().allocated_bytes() - before) / static_cast<double>(plan.bytes);
}

void expect_stated(double taken) {
  EXPECT_LE(taken, 1);
  EXPECT_GE(taken, 0.8);
}

TEST(Plan, StatesTheMemoryOfEikonal) {
  expect_stated(taken_of_stated("eikonal.yaml", {"grid.dx_mm=4", "torso.dx_mm=20", "time.end_ms=50"},
                                ActivationMethod::eikonal));
}

TEST(Plan, StatesTheMemoryOfReactionEikonal) {
  expect_stated(taken_of_stated("eikonal.yaml",
                                {"grid.dx_mm=4", "torso.dx_mm=20", "time.end_ms=5",
                                 "scene.electrophysiology.activation=reaction_eikonal"},
                                ActivationMethod::reaction_eikonal));
}

TEST(Plan, StatesTheMemoryOfMonodomainWithBeats) {
  expect_stated(
      taken_of_stated("slab.yaml",
                      {"grid.dx_mm=0.5", "time.end_ms=200", "scene.electrophysiology.activation=monodomain",
                       "outputs={activation: {probes: {far_mm: [10, 3, 3]}, beats: true}}"},
                      ActivationMethod::monodomain));
}

TEST(Plan, StatesTheMemoryOfBidomain) {
  expect_stated(
      taken_of_stated("bidomain.yaml", {"time.end_ms=2", "torso.dx_mm=20"}, ActivationMethod::bidomain));
}

TEST(Plan, NamesTheMethod) {
  Plan plan;
  plan.activation = ActivationMethod::bidomain;
  plan.activation_reason = "why";
  EXPECT_EQ(conduction_lines(plan).front(), "activation by bidomain: why");
}

TEST(Plan, AForwardEcgTakesATimeLoop) {
  const std::vector<std::string> forward = {"grid.dx_mm=4", "torso.dx_mm=20", "outputs.ecg.method=forward",
                                            "scene.electrophysiology.activation=automatic"};
  const Campaign campaign = campaign_of("eikonal.yaml", forward);
  const Plan plan = make_plan(device(), campaign.scene, {}, {});
  EXPECT_EQ(plan.activation, ActivationMethod::reaction_eikonal);
  EXPECT_NE(plan.activation_reason.find("forward"), std::string::npos) << plan.activation_reason;
}

}  // namespace
}  // namespace cohort::test
