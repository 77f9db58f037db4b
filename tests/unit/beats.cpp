// Action potentials of a recorded potential, and features of beats at probes.
#include "solver/beats.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "solver/stimulus.hpp"
#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

// From -80 mV a jump to `peak`, then a straight line back to -80 mV within `fall` ms; samples every ms.
void append_beat(std::vector<float>& potential, float peak, int fall, int rest) {
  for (int k = 0; k < fall; ++k)
    potential.push_back(peak + (-80 - peak) * static_cast<float>(k) / static_cast<float>(fall));
  potential.insert(potential.end(), static_cast<std::size_t>(rest), -80.0f);
}

TEST(Beats, AreMeasuredAtNinetyPercent) {
  std::vector<float> potential(10, -80.0f);
  append_beat(potential, 20, 200, 50);  // samples 10 ... 209
  append_beat(potential, 0, 100, 50);   // samples 260 ... 359
  const std::vector<Beat> found = beats(potential, 1, -30);
  ASSERT_EQ(found.size(), 2u);
  // Between samples 9 (-80) and 10 (20): half way. Nine tenths of the way down: 180 ms after sample 10.
  EXPECT_NEAR(found[0].activation_ms, 9.5, 1e-6);
  EXPECT_NEAR(found[0].repolarisation_ms, 190, 1e-4);
  EXPECT_NEAR(found[1].activation_ms, 259 + 50.0 / 80, 1e-6);
  EXPECT_NEAR(found[1].repolarisation_ms, 350, 1e-4);
  const std::vector<Beat> twice_as_far = beats(potential, 2, -30);
  EXPECT_NEAR(twice_as_far[1].repolarisation_ms, 700, 1e-3);
}

TEST(Beats, OneThatDoesNotEndIsNoNumber) {
  std::vector<float> potential(5, -80.0f);
  append_beat(potential, 20, 200, 0);
  potential.resize(100);
  const std::vector<Beat> found = beats(potential, 1, -30);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(std::isnan(found[0].repolarisation_ms));
}

TEST(Beats, NoneWithoutAnUpstroke) {
  EXPECT_TRUE(beats(std::vector<float>(50, -80.0f), 1, -30).empty());
  EXPECT_TRUE(beats({}, 1, -30).empty());
}

// APD90 after each of the pulses at `times`: Mitchell & Schaeffer 2003, equations (1) to (4) with this
// program's defaults and the stimulus of configs/slab.yaml, by explicit Euler steps of 0.002 ms.
std::vector<double> single_cell_apds(const std::vector<double>& times) {
  constexpr double tau_in = 0.3, tau_out = 6, tau_open = 120, tau_close = 150, v_gate = 0.13, dt = 0.002;
  constexpr double threshold = 45.0 / 105, stimulus = 35.714 / 105;
  double v = 0, h = 1, activation = 0, peak = 0;
  bool active = false;
  std::vector<double> result;
  for (double time = 0; time < times.back() + 500; time += dt) {
    const bool on =
        std::any_of(times.begin(), times.end(), [&](double t) { return time >= t && time < t + 2; });
    const double before = v;
    v += dt * (h * v * v * (1 - v) / tau_in - v / tau_out + (on ? stimulus : 0));
    h += dt * (before < v_gate ? (1 - h) / tau_open : -h / tau_close);
    if (!active && before < threshold && v >= threshold) {
      activation = time;
      peak = 0;
      active = true;
    }
    peak = std::max(peak, v);
    if (active && before > v && v <= 0.1 * peak) {
      result.push_back(time - activation);
      active = false;
    }
  }
  return result;
}

// A short cable, stimulated all along: every cell of it is a single cell.
const std::vector<std::string> cable = {
    "geometry.box.size_mm=[8, 1, 1]",
    "grid.dx_mm=1",
    "electrophysiology.conductivity_longitudinal_mS_per_mm=1",
    "electrophysiology.activation_threshold_mV=-40",
    "stimuli.corner.upper_mm=[9, 9, 9]",
    "outputs.activation={beats: true, probes: {far_mm: [7.5, 0.5, 0.5], outside_mm: [30, 0, 0]}}"};

CampaignRun paced(const std::vector<std::string>& more) {
  std::vector<std::string> overrides = cable;
  overrides.insert(overrides.end(), more.begin(), more.end());
  return CampaignRun("configs/slab.yaml", overrides);
}

TEST(BeatFeatures, CountATrainAndItsS2) {
  const CampaignRun run = paced({"time.end_ms=2300", "stimuli.corner.period_ms=600", "stimuli.corner.count=3",
                                 "stimuli.corner.s2_interval_ms=450"});
  ASSERT_EQ(run.recording().outcome, Outcome::done) << run.recording().reason;
  EXPECT_EQ(run.feature("activations_far"), 4);
  EXPECT_EQ(run.feature("activations_most_tissue"), 4);
  const double first = run.feature("activation_far_ms"), latest = run.feature("activation_latest_far_ms");
  EXPECT_NEAR(latest - first, 2 * 600 + 450, 3);
  EXPECT_GE(run.feature("activation_latest_tissue_ms"), latest - 0.1);
  const double apd = run.feature("apd90_far_ms"), di = run.feature("di_far_ms");
  const CampaignRun train =
      paced({"time.end_ms=1800", "stimuli.corner.period_ms=600", "stimuli.corner.count=3"});
  const double train_apd = train.feature("apd90_far_ms");
  EXPECT_NEAR(train_apd + train.feature("di_far_ms"), 600, 8) << "from upstroke to upstroke";
  EXPECT_NEAR(di + train_apd, 450, 8);
  EXPECT_LT(apd, train_apd - 5);
  const std::vector<double> single = single_cell_apds({0, 600, 1200, 1650});
  EXPECT_NEAR(train_apd, single[2], 1);
  EXPECT_NEAR(apd, single[3], 1);
}

TEST(BeatFeatures, AreUndefinedWhereThereIsNoTissueOrNoEnd) {
  const CampaignRun run = paced({"time.end_ms=100"});
  EXPECT_EQ(run.feature("activations_far"), 1);
  EXPECT_TRUE(std::isnan(run.feature("apd90_far_ms")));
  EXPECT_TRUE(std::isnan(run.feature("di_far_ms")));
  EXPECT_TRUE(std::isnan(run.feature("activations_outside")));
}

TEST(BeatFeatures, ChangeNothingElse) {
  const CampaignRun with = paced({"time.end_ms=100"});
  const CampaignRun without = paced({"time.end_ms=100", "outputs.activation.beats=false"});
  for (const char* name : {"activation_far_ms", "activation_first_tissue_ms", "activation_last_tissue_ms"})
    EXPECT_EQ(with.feature(name), without.feature(name)) << name;
  EXPECT_THROW(without.feature("activations_far"), std::out_of_range);
}

std::vector<std::string> warnings(std::vector<std::string> overrides, const std::string& file = "slab") {
  overrides.insert(overrides.begin(), "time.end_ms=1000");
  const Campaign campaign =
      read_campaign(std::string(COHORT_SOURCE_DIR) + "/configs/" + file + ".yaml", overrides);
  return stimulus_warnings(campaign.scene, members(campaign)[0].values);
}

TEST(StimulusWarnings, TellOfABoundaryCurrentThatNeverFlows) {
  const std::string root = "electrophysiology.boundary_current_";
  const std::string density = root + "uA_per_mm2.x=3";
  EXPECT_TRUE(warnings({}, "bidomain").empty());
  EXPECT_TRUE(warnings({density, root + "duration_ms=2"}, "bidomain").empty());
  for (const std::vector<std::string>& odd : {std::vector{density},
                                              {root + "duration_ms=2"},
                                              {density, root + "duration_ms=2", root + "start_ms=1000"}}) {
    const std::vector<std::string> told = warnings(odd, "bidomain");
    ASSERT_EQ(told.size(), 1u) << odd.back();
    EXPECT_NE(told[0].find("boundary current never flows"), std::string::npos);
  }
}

TEST(StimulusWarnings, TellWhatIsOdd) {
  const auto one = [](const std::vector<std::string>& overrides) {
    const std::vector<std::string> all = warnings(overrides);
    return all.size() == 1 ? all[0] : std::to_string(all.size()) + " warnings";
  };
  const std::string corner = "stimuli.corner.";
  EXPECT_TRUE(warnings({}).empty());
  EXPECT_TRUE(
      warnings({corner + "period_ms=300", corner + "count=3", corner + "s2_interval_ms=200"}).empty());
  EXPECT_NE(one({corner + "start_ms=1000"}).find("\"corner\" never fires"), std::string::npos);
  EXPECT_NE(one({corner + "period_ms=300", corner + "count=5"}).find("to its last pulse"), std::string::npos);
  EXPECT_NE(one({corner + "s2_interval_ms=1200"}).find("to its last pulse"), std::string::npos);
  EXPECT_NE(one({corner + "count=5"}).find("without period_ms"), std::string::npos);
  EXPECT_NE(one({corner + "period_ms=300"}).find("without count"), std::string::npos);
  EXPECT_NE(one({corner + "amplitude_mV_per_ms=0"}).find("does nothing"), std::string::npos);
  EXPECT_NE(one({corner + "period_ms=1", corner + "count=3"}).find("overlaps itself"), std::string::npos);
}

}  // namespace
}  // namespace cohort::test
