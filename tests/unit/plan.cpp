// What a plan chooses, lists, refuses and warns of.
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>
#include <stdexcept>
#include <tuple>

#include "ensemble/plan_campaign.hpp"
#include "solver/mechanics.hpp"
#include "solver/trial.hpp"
#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

// Of the first steps of a batch, as `cohort plan` takes them.
Trial trial_of(const std::string& file, const std::vector<std::string>& overrides) {
  const Campaign campaign = campaign_of(file, overrides);
  const Plan plan = make_plan(device(), campaign.scene, {}, {});
  return try_out(device(), campaign.scene, plan, {}, 0.2);
}

const std::vector<std::string> coarse_beat = {"grid.dx_mm=6", "mechanics.dx_mm=8",
                                              "outputs={pv: {rate_hz: 1000}}"};

TEST(Plan, ListsWhatRuns) {
  const auto built = [](const Trial& trial, const char* kernel) {
    return std::any_of(trial.footprint.kernels.begin(), trial.footprint.kernels.end(),
                       [&](const Footprint::Kernel& k) { return k.name == kernel; });
  };
  const Trial heart = trial_of("heart.yaml", coarse_beat);
  EXPECT_FALSE(built(heart, "advance_circulation"));
  EXPECT_TRUE(built(heart, "start_circulation"));
  EXPECT_TRUE(built(heart, "solid_beat"));
  EXPECT_FALSE(built(heart, "solid_record"));
  EXPECT_FALSE(built(heart, "lead_weights"));
  EXPECT_TRUE(built(trial_of("circulation.yaml", {}), "advance_circulation"));
  EXPECT_TRUE(built(trial_of("arostica.yaml", {"grid.dx_mm=8"}), "solid_record"));
}

// Ogden's law costs several times the neo-Hookean one, and steps are run to see it.
TEST(Plan, SecondsAreThoseOfTheLaw) {
  if (device().info().gpu) GTEST_SKIP() << "a step of one small heart is its launches there";
  const auto step_s = [](const std::string& law) {
    std::vector<std::string> overrides = coarse_beat;
    overrides.push_back("scene.mechanics.law=" + law);
    return trial_of("heart.yaml", overrides).step_s;
  };
  const double neo_hookean = step_s("neo_hookean"), ogden = step_s("ogden");
  std::printf("a step: neo-Hookean %.2f ms, Ogden %.2f ms\n", 1e3 * neo_hookean, 1e3 * ogden);
  EXPECT_GT(ogden, 1.5 * neo_hookean);
}

TEST(Plan, MechanicsHasNoFinerGridThanTheScene) {
  for (const auto& [wave, tissue, expected] :
       {std::tuple{2., 4., 4.}, std::tuple{4., 2., 4.}, std::tuple{3., 0., 3.}}) {
    const Campaign campaign = campaign_of(
        "heart.yaml", {"grid.dx_mm=" + std::to_string(wave), "mechanics.dx_mm=" + std::to_string(tissue)});
    EXPECT_EQ(solid_dx_mm(campaign.scene), expected);
  }
}

// Of a circulation alone a trial is the whole run: its beats are those that members take.
TEST(Plan, ACirculationIsTriedToItsEnd) {
  const Trial trial = trial_of("circulation.yaml", {"time.beats.at_most=3"});
  EXPECT_TRUE(trial.beats_are_known);
  EXPECT_GT(trial.beats, 1);
  EXPECT_LE(trial.beats, 3);
  EXPECT_GT(trial.seconds_per_member, 0);
}

// What samples take is in the steps: those of a slab are known to the number.
TEST(Plan, AMonodomainIsItsSteps) {
  const Trial trial = trial_of("slab.yaml", {"grid.dx_mm=1", "time.end_ms=50"});
  EXPECT_EQ(trial.steps, 1000);
  EXPECT_GE(trial.launches_per_step, 2);
  EXPECT_NEAR(trial.seconds_per_member, trial.setup_s + trial.steps * trial.step_s, 1e-9);
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
