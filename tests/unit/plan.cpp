// What a plan states beside what then runs.
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <sstream>
#include <stdexcept>
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
  EXPECT_GE(taken.kept, 0.8);
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

TEST(Plan, StatesTheMemoryOfABeatingHeart) {
  const std::vector<std::string> coarse = {"grid.dx_mm=5", "torso.dx_mm=20", "time.beats.at_most=1",
                                           "time.beats.length_ms=300"};
  const Taken taken = taken_of_stated("heart.yaml", coarse, ActivationMethod::eikonal);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.85);
}

TEST(Plan, StatesTheMemoryOfTissueUnderPressure) {
  const Taken taken =
      taken_of_stated("arostica.yaml", {"grid.dx_mm=5", "time.end_ms=5"}, ActivationMethod::automatic);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.85);
}

// Hearts that are larger than the scene's own.
TEST(Plan, StatesTheMemoryOfSampledHearts) {
  const Taken taken = taken_of_stated("demo.yaml",
                                      {"grid.dx_mm=6", "torso.dx_mm=20", "time.beats.at_most=1",
                                       "time.beats.length_ms=300", "campaign.members=4"},
                                      ActivationMethod::eikonal, 2);
  EXPECT_LE(taken.peak, 1);
  EXPECT_GE(taken.peak, 0.75);
}

TEST(Plan, ListsWhatRuns) {
  const auto kernels = [](const std::string& file, const std::vector<std::string>& overrides,
                          const std::string& module) {
    const Campaign campaign = campaign_of(file, overrides);
    for (const PlannedModule& planned : make_plan(device(), campaign.scene, {}, {}).modules)
      if (planned.name == module) return planned.kernels;
    return std::vector<std::string>();
  };
  const auto has = [](const std::vector<std::string>& all, const char* kernel) {
    return std::find(all.begin(), all.end(), kernel) != all.end();
  };
  const std::vector<std::string> coarse = {"grid.dx_mm=6", "torso.dx_mm=20"};
  EXPECT_FALSE(has(kernels("heart.yaml", coarse, "circulation"), "advance_circulation"));
  EXPECT_TRUE(has(kernels("heart.yaml", coarse, "circulation"), "start_circulation"));
  EXPECT_TRUE(has(kernels("heart.yaml", coarse, "mechanics"), "solid_beat"));
  EXPECT_FALSE(has(kernels("heart.yaml", coarse, "mechanics"), "solid_record"));
  EXPECT_TRUE(has(kernels("circulation.yaml", {}, "circulation"), "advance_circulation"));
  EXPECT_TRUE(has(kernels("arostica.yaml", {"grid.dx_mm=8"}, "mechanics"), "solid_record"));
}

// A CPU's step is measured: Ogden's law costs several times the neo-Hookean one.
TEST(Plan, SecondsAreThoseOfTheLaw) {
  if (device().info().gpu) GTEST_SKIP() << "a GPU's seconds are those of launches and traffic";
  const auto step_s = [](const std::string& law) {
    const Campaign campaign = campaign_of(
        "heart.yaml",
        {"grid.dx_mm=6", "torso.dx_mm=20", "outputs={pv: {rate_hz: 1000}}", "scene.mechanics.law=" + law});
    const Plan plan = make_plan(device(), campaign.scene, {}, {});
    return plan.seconds_per_member / plan.steps;
  };
  const double neo_hookean = step_s("neo_hookean"), ogden = step_s("ogden");
  std::printf("a step: neo-Hookean %.2f ms, Ogden %.2f ms\n", 1e3 * neo_hookean, 1e3 * ogden);
  EXPECT_GT(ogden, 1.5 * neo_hookean);
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

// What `make_plan` says of a campaign's own values on the log.
std::string warnings_of(const std::vector<std::string>& overrides) {
  const Campaign campaign = campaign_of("ecg.yaml", overrides);
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  make_plan(device(), campaign.scene, {}, {});
  spdlog::set_default_logger(before);
  return log.str();
}

const std::string system_path = "scene.electrophysiology.conduction_system.";

TEST(Plan, WarnsOfVentriclesThatNothingActivates) {
  const std::vector<std::string> coarse = {"grid.dx_mm=4", "torso.dx_mm=20"};
  std::vector<std::string> overrides = coarse;
  for (const char* name :
       {"lv_septum", "lv_anterior", "lv_inferior", "lv_lateral", "rv_septum", "rv_free_wall"}) {
    EXPECT_EQ(warnings_of(overrides).find("never activated"), std::string::npos) << "before " << name;
    overrides.push_back(system_path + "early_sites." + name + "=off");
  }
  EXPECT_NE(warnings_of(overrides).find("the ventricles are never activated"), std::string::npos);
}

TEST(Plan, WarnsOfConductivitiesThatNothingReads) {
  const std::vector<std::string> open = {"grid.dx_mm=4", "torso.dx_mm=20",
                                         "scene.electrophysiology.activation=automatic"};
  EXPECT_EQ(warnings_of(open).find("no effect"), std::string::npos);
  std::vector<std::string> overrides = open;
  overrides.emplace_back("scene.electrophysiology.conductivity_transverse_mS_per_mm=0.1");
  EXPECT_NE(warnings_of(overrides).find("conductivity_transverse_mS_per_mm have no effect"),
            std::string::npos);
  overrides = open;
  overrides.emplace_back("scene.electrophysiology.regions.la.conductivity_longitudinal_mS_per_mm=0.1");
  EXPECT_NE(warnings_of(overrides).find("no effect"), std::string::npos);
}

TEST(Plan, RefusesLayersThatCross) {
  const std::string layers = "electrophysiology.heterogeneity.";
  const auto plan = [&](double until, double from, size_t crossing) {
    const Campaign campaign = campaign_of("ecg.yaml", {"grid.dx_mm=4", "torso.dx_mm=20"});
    std::vector<Member> members;
    for (size_t m = 0; m < 2; ++m) {
      members.push_back({static_cast<std::int64_t>(m), campaign.scene.parameters.values()});
      if (m < crossing) {
        const ParameterTable& table = campaign.scene.parameters;
        members[m].values[static_cast<size_t>(table.index(layers + "endocardial_until"))] = until;
        members[m].values[static_cast<size_t>(table.index(layers + "epicardial_from"))] = from;
      }
      campaign.scene.parameters.resolve(members[m].values);
    }
    make_plan(device(), campaign.scene, members, {});
  };
  EXPECT_THROW(plan(0.9, 0.1, 2), std::invalid_argument);
  EXPECT_NO_THROW(plan(0.9, 0.1, 1));  // that member alone is rejected
  EXPECT_NO_THROW(plan(0.5, 0.5, 2));  // two layers
}

}  // namespace
}  // namespace cohort::test
