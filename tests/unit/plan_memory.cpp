// The memory that a plan states, beside what then is allocated: more cases than files of configs/, of which
// tests/unit/footprint.cpp sees each.
#include <chrono>
#include <thread>

#include "ensemble/members.hpp"
#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

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

struct Taken {
  double peak, kept;  ///< of what the plan states: the most at once, and behind the run
};

/// Bytes of the device that runs of a campaign's members take, over those that the plan states. batch 0: the
/// scene's own heart alone.
Taken taken_of_stated(const std::string& file, const std::vector<std::string>& overrides,
                      ActivationMethod method, int batch = 0) {
  const Campaign campaign = campaign_of(file, overrides);
  const Scene& scene = campaign.scene;
  std::vector<Member> all = {{0, scene.parameters.values()}};
  scene.parameters.resolve(all[0].values);
  if (batch > 0) all = members(campaign);
  PlanOptions options;
  options.members_per_device = std::max(batch, 1);
  make_plan(device(), scene, all, options);  // what a device keeps for good is there behind the first
  const std::size_t before = settled_bytes();
  const Plan plan = make_plan(device(), scene, all, options);
  if (method != ActivationMethod::automatic) {
    EXPECT_EQ(plan.activation, method);
  }
  EXPECT_EQ(settled_bytes(), before);
  device().restart_peak();
  Simulation simulation(device(), scene, plan);
  const auto size = static_cast<std::size_t>(options.members_per_device);
  for (std::size_t first = 0; first + size <= all.size(); first += size) {
    settled_bytes();
    for (const Recording& recording : simulation.run(std::span(all).subspan(first, size), 600))
      EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  }
  const double stated = static_cast<double>(plan.bytes);
  const Taken taken = {static_cast<double>(device().peak_bytes() - before) / stated,
                       static_cast<double>(device().allocated_bytes() - before) / stated};
  std::printf("%s: %.3f MB stated, %.3f of it at the peak, %.3f kept\n", file.c_str(), stated * 1e-6,
              taken.peak, taken.kept);
  return taken;
}

void expect_stated(const Taken& taken) {
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.95);
  EXPECT_GE(taken.kept, 0.8);
}

TEST(PlanMemory, OfEikonal) {
  expect_stated(taken_of_stated("eikonal.yaml", {"grid.dx_mm=4", "torso.dx_mm=20", "time.end_ms=50"},
                                ActivationMethod::eikonal));
}

TEST(PlanMemory, OfReactionEikonal) {
  expect_stated(taken_of_stated("eikonal.yaml",
                                {"grid.dx_mm=4", "torso.dx_mm=20", "time.end_ms=5",
                                 "scene.electrophysiology.activation=reaction_eikonal"},
                                ActivationMethod::reaction_eikonal));
}

TEST(PlanMemory, OfMonodomainWithBeats) {
  expect_stated(
      taken_of_stated("slab.yaml",
                      {"grid.dx_mm=0.5", "time.end_ms=200", "scene.electrophysiology.activation=monodomain",
                       "outputs={activation: {probes: {far_mm: [10, 3, 3]}, beats: true}}"},
                      ActivationMethod::monodomain));
}

TEST(PlanMemory, OfBidomain) {
  expect_stated(
      taken_of_stated("bidomain.yaml", {"time.end_ms=2", "torso.dx_mm=20"}, ActivationMethod::bidomain));
}

TEST(PlanMemory, OfABeatingHeart) {
  const std::vector<std::string> coarse = {"grid.dx_mm=5", "torso.dx_mm=20", "time.beats.at_most=1",
                                           "time.beats.length_ms=300"};
  const Taken taken = taken_of_stated("heart.yaml", coarse, ActivationMethod::eikonal);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.95);
}

TEST(PlanMemory, OfTissueUnderPressure) {
  const Taken taken =
      taken_of_stated("arostica.yaml", {"grid.dx_mm=5", "time.end_ms=5"}, ActivationMethod::automatic);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.95);
}

// Hearts that are larger than the scene's own.
TEST(PlanMemory, OfSampledHearts) {
  const Taken taken = taken_of_stated("demo.yaml",
                                      {"grid.dx_mm=6", "torso.dx_mm=20", "time.beats.at_most=1",
                                       "time.beats.length_ms=300", "campaign.members=4"},
                                      ActivationMethod::eikonal, 2);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.95);
}

// Counted by their largest they would be a tenth too many.
TEST(PlanMemory, OfLargeBatches) {
  const Taken taken = taken_of_stated("eikonal.yaml",
                                      {"grid.dx_mm=5", "torso.dx_mm=20", "time.end_ms=50",
                                       "campaign.members=32", "campaign.check_fraction=0"},
                                      ActivationMethod::eikonal, 16);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.95);
}

TEST(PlanMemory, FewerMembersWhereItIsShort) {
  if (!device().info().gpu) GTEST_SKIP() << "one heart after another on a CPU";
  const Campaign campaign = campaign_of("eikonal.yaml", {"grid.dx_mm=2", "campaign.members=64"});
  const std::vector<Member> all = members(campaign);
  const Plan whole = make_plan(device(), campaign.scene, all, {});
  ASSERT_GT(whole.members_per_device, 4);
  PlanOptions options;
  options.memory_limit_bytes = whole.bytes / 3;
  const Plan fewer = make_plan(device(), campaign.scene, all, options);
  EXPECT_LT(fewer.members_per_device, whole.members_per_device / 2);
  EXPECT_GE(fewer.members_per_device, whole.members_per_device / 5);
  EXPECT_LE(fewer.bytes, options.memory_limit_bytes);
  options.members_per_device = whole.members_per_device;  // asked for
  EXPECT_THROW(make_plan(device(), campaign.scene, all, options), std::runtime_error);
}

}  // namespace
}  // namespace cohort::test
