// Arithmetic and settings of studies of error against run time, and of the choice by accuracy.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ensemble/config.hpp"
#include "ensemble/feature_names.hpp"
#include "ensemble/measurements.hpp"
#include "ensemble/work_precision_orders.hpp"

namespace cohort {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// Without noise.
std::vector<Seconds> seconds(const std::vector<double>& medians) {
  std::vector<Seconds> result;
  for (const double median : medians) result.push_back({median, median, median});
  return result;
}

TEST(Front, IsWhatNothingBeatsInBoth) {
  const std::vector<Seconds> time = seconds({1, 2, 3, 4, 5, 24});
  const std::vector<double> error = {10, 4, 6, 1, NaN, 9};
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_DOUBLE_EQ(distance_to_front(time, error, i).factor, 1);
  // 3 s for 6: 2 s give 4, which is 1.5 in time and in error.
  const FrontDistance near = distance_to_front(time, error, 2);
  EXPECT_DOUBLE_EQ(near.factor, 1.5);
  EXPECT_DOUBLE_EQ(near.slower, 1.5);
  EXPECT_DOUBLE_EQ(near.worse, 1.5);
  // 24 s for 9: of the others' advantages (12, 2.25), (8, 1.5) and (6, 9) the last is the larger in both.
  const FrontDistance far = distance_to_front(time, error, 5);
  EXPECT_DOUBLE_EQ(far.factor, 6);
  EXPECT_DOUBLE_EQ(far.slower, 12);
  EXPECT_DOUBLE_EQ(far.worse, 9);
  EXPECT_TRUE(std::isnan(distance_to_front(time, error, 4).factor));
}

TEST(Front, OfEqualsTheOtherFactorCountsAlone) {
  EXPECT_DOUBLE_EQ(distance_to_front(seconds({1, 1}), {2, 2}, 1).factor, 1);
  // The same error to 1e-3, 7.8 times as slow.
  EXPECT_DOUBLE_EQ(distance_to_front(seconds({1, 7.8}), {2, 2}, 1).factor, 7.8);
  EXPECT_DOUBLE_EQ(distance_to_front(seconds({1, 7.8}), {2, 1.999}, 1).factor, 7.8);
  EXPECT_DOUBLE_EQ(distance_to_front(seconds({1, 7.8}), {2, 1.9}, 1).factor, 1);
  EXPECT_DOUBLE_EQ(distance_to_front(seconds({1, 1}), {1, 3}, 1).factor, 3);
}

TEST(Front, TakesNoNoiseForSpeed) {
  const std::vector<Seconds> time = {{1, 0.9, 1.2}, {1.25, 1.24, 1.26}, {1.4, 1.39, 1.41}};
  EXPECT_DOUBLE_EQ(distance_to_front(time, {2, 2, 2}, 1).factor, 1);
  EXPECT_DOUBLE_EQ(distance_to_front(time, {2, 2, 2}, 1).slower, 1);
  EXPECT_DOUBLE_EQ(distance_to_front(time, {2, 2, 2}, 2).factor, 1.4);
  EXPECT_DOUBLE_EQ(distance_to_front(time, {2, 6, 2}, 1).factor, 3);
}

TEST(Order, IsFoundThroughTheErrorOfTheReference) {
  const auto error = [](double h, double p, double r) { return std::pow(h, p) - std::pow(r, p); };
  for (const double p : {0.7, 1.0, 2.0, 3.5}) {
    EXPECT_NEAR(observed_order(error(4, p, 0), error(2, p, 0), 4, 2, 0), p, 1e-6);
    EXPECT_NEAR(observed_order(error(4, p, 1), error(2, p, 1), 4, 2, 1), p, 1e-6);
  }
  EXPECT_TRUE(std::isnan(observed_order(1, 2, 4, 2, 0)));  // errors that grow
  EXPECT_TRUE(std::isnan(observed_order(1, NaN, 4, 2, 0)));
}

/// A run of configs/BASE.yaml with settings, and one feature.
SettingRun run_of(const std::string& base, const std::vector<std::string>& overrides, float feature = 0) {
  SettingRun run;
  run.resolved =
      resolved(read_campaign(std::string(COHORT_SOURCE_DIR) + "/configs/" + base + ".yaml", overrides));
  run.layout.features = {"x"};
  run.layout.feature_units = {"1"};
  run.recordings.resize(1);
  run.recordings[0].outcome = Outcome::done;
  run.recordings[0].features = {feature};
  return run;
}

std::vector<ObservedOrder> orders(const std::vector<SettingRun>& runs, const std::vector<double>& errors,
                                  const SettingRun* reference) {
  MeasureErrors measure{"x", "1", {}, {}};
  for (const double error : errors) measure.of.push_back({error});
  return observed_orders(runs, reference, {measure});
}

TEST(Order, PairsSettingsThatDifferInOneStep) {
  const std::vector<SettingRun> runs = {
      run_of("circulation", {"circulation.dt_ms=4"}), run_of("circulation", {"circulation.dt_ms=2"}),
      run_of("circulation", {"circulation.dt_ms=1"}),
      run_of("circulation", {"circulation.dt_ms=1", "precision=double"}),
      run_of("circulation",
             {"circulation.dt_ms=0.5", "circulation.valves.open_resistance_mmHg_s_per_mL=0.02"})};
  const auto found = orders(runs, {16, 4, 1, 1, 0.2}, nullptr);
  ASSERT_EQ(found.size(), 2u);
  for (const ObservedOrder& order : found) EXPECT_NEAR(order.order, 2, 1e-6);
  EXPECT_EQ(found[0].coarse, 0u);
  EXPECT_EQ(found[0].fine, 1u);
  EXPECT_EQ(found[1].fine, 2u);
}

TEST(Order, TakesTheStepThatTheReferenceDoesNotNameFromItsScene) {
  // The reference is a run at the scene's step, 1 ms: errors of second order against it.
  const SettingRun reference = run_of("circulation", {"precision=double"});
  const std::vector<SettingRun> runs = {run_of("circulation", {"circulation.dt_ms=4"}),
                                        run_of("circulation", {"circulation.dt_ms=2"}),
                                        run_of("circulation", {})};
  const auto found = orders(runs, {16 - 1, 4 - 1, 1e-6}, &reference);
  ASSERT_EQ(found.size(), 1u);  // 1 ms is no coarser than the reference
  EXPECT_NEAR(found[0].order, 2, 1e-6);
}

TEST(Order, OfTwoSpacingsThatGoTogetherNamesBoth) {
  // The mechanics' grid of the heart, 2 mm unless set, is at least the scene's.
  const std::vector<SettingRun> runs = {run_of("heart", {"grid.dx_mm=4"}), run_of("heart", {"grid.dx_mm=2"}),
                                        run_of("heart", {"grid.dx_mm=1"}),
                                        run_of("heart", {"grid.dx_mm=3", "mechanics.dx_mm=8"})};
  const auto found = orders(runs, {16, 4, 1, 9}, nullptr);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].path, "grid.dx_mm, mechanics.dx_mm");
  EXPECT_EQ(found[0].fine, 1u);
  EXPECT_EQ(found[1].path, "grid.dx_mm");
  // 0.25 and 1 mm: an eighth of one, half of the other.
  const SettingRun unlike = run_of("heart", {"grid.dx_mm=0.25", "mechanics.dx_mm=1"});
  const auto left = orders(runs, {16, 4, 1, 9}, &unlike);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left[0].path, "grid.dx_mm");
}

TEST(Rounding, IsTheWayBetweenTwinsOverTheError) {
  const auto share = [](const std::vector<SettingRun>& runs) {
    return rounding_shares(runs, {MeasureErrors{"x", "1", {{0.5}, {0.25}}, {}}});
  };
  // What neither sets is the base's: land_inflation.yaml is in double precision, Strang's splitting is the
  // default.
  for (const auto& runs : {std::vector{run_of("land_inflation", {"precision=single"}, 1.5F),
                                       run_of("land_inflation", {}, 1.25F)},
                           std::vector{run_of("restitution", {"electrophysiology.splitting=strang"}, 1.5F),
                                       run_of("restitution", {"precision=double"}, 1.25F)}}) {
    const auto shares = share(runs);
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_DOUBLE_EQ(shares[0].apart, 0.25);
    EXPECT_DOUBLE_EQ(shares[0].share, 0.5);
  }
  EXPECT_TRUE(share({run_of("restitution", {"electrophysiology.splitting=godunov"}, 1.5F),
                     run_of("restitution", {"precision=double"}, 1.25F)})
                  .empty());
}

TEST(FlowText, IsTheSameValueAgain) {
  Mistakes mistakes;
  Node node = parse_document("{a: \"say \\\"x\\\", \\\\ y\", 'b, c': ['[', 2, \"2\"]}", "x", mistakes);
  const std::string text = flow_text(node);
  Node again = parse_document(text, "x", mistakes);
  ASSERT_TRUE(mistakes.empty()) << text;
  EXPECT_EQ(again.find("a")->text, "say \"x\", \\ y") << text;
  ASSERT_TRUE(again.find("b, c")) << text;
  EXPECT_EQ(again.find("b, c")->items[0].text, "[");
  EXPECT_FALSE(again.find("b, c")->items[1].quoted);
  EXPECT_TRUE(again.find("b, c")->items[2].quoted);
  Node block = parse_document("a: one, two", "x", mistakes);
  EXPECT_EQ(parse_document(flow_text(block), "x", mistakes).find("a")->text, "one, two");
}

TEST(Errors, AgainstValuesAndSeries) {
  SettingRun run, reference;
  run.layout.features = reference.layout.features = {"lv_ef_percent"};
  run.layout.feature_units = reference.layout.feature_units = {"%"};
  run.recordings.resize(1);
  reference.recordings.resize(1);
  run.recordings[0].outcome = reference.recordings[0].outcome = Outcome::done;
  run.recordings[0].features = {50};
  reference.recordings[0].features = {52};
  run.recordings[0].ecg = {1, 2, 2};
  reference.recordings[0].ecg = {1, 2, 2.3f};
  const auto against_run = measure_errors({"LV_EF", "ecg"}, {run}, &reference, {});
  EXPECT_EQ(against_run[0].name, "lv_ef_percent");
  EXPECT_DOUBLE_EQ(against_run[0].of[0][0], -2);
  EXPECT_NEAR(against_run[1].rms(0), 100 * 0.3 / std::sqrt(1 + 4 + 2.3 * 2.3), 1e-4);
  EXPECT_DOUBLE_EQ(measure_errors({"LV_EF"}, {run}, nullptr, {{"LV_EF", 49.5}})[0].of[0][0], 0.5);
  EXPECT_THROW(measure_errors({"ecg"}, {run}, nullptr, {}), std::runtime_error);
  EXPECT_THROW(measure_errors({"QRS"}, {run}, &reference, {}), std::runtime_error);
  run.recordings[0].outcome = Outcome::unstable;
  EXPECT_TRUE(std::isnan(measure_errors({"LV_EF"}, {run}, &reference, {})[0].largest(0)));
}

TEST(FeatureNames, AreFoundWithoutUnitAndCase) {
  const std::vector<std::string> names = {"ecg_QRS_ms",    "ecg_QRS_axis_deg", "lv_ef_percent",
                                          "rv_ef_percent", "activation_p_ms",  "activation_p"};
  EXPECT_EQ(find_feature(names, "QRS"), 0u);
  EXPECT_EQ(find_feature(names, "qrs_axis"), 1u);
  EXPECT_EQ(find_feature(names, "LV_EF"), 2u);
  EXPECT_EQ(find_feature(names, "activation_p"), 5u);  // the whole name comes first
  EXPECT_FALSE(find_feature(names, "EF"));
  EXPECT_FALSE(find_feature({"x_ms", "x_mL"}, "x"));  // two are so called
}

TEST(Measurements, ComeBackAsTheyWereWritten) {
  Measurements m;
  m.program = "1";
  m.study = "a \"study\".yaml";
  m.device = "x";
  m.reference = "grid.dx_mm=1";
  m.members = 12;
  m.structure = {"geometry heart", "region lv shape \"\" excitable fibres transmural"};
  m.values = {{"grid.dx_mm", 2}};
  m.sampled = {{"a.b", {1, 2.5}}};
  m.features = {{"lv_ef_percent", "%"}};
  m.settings = {{"4 mm", {{"grid.dx_mm", "4"}}, 0.5, {{"lv_ef_percent", {1, 2, 3, 4}}}},
                {"1 mm", {{"grid.dx_mm", "1"}}, 2, {{"lv_ef_percent", {0.1, 0.2, INFINITY, INFINITY}}}}};
  const Measurements back = read_measurements(measurements_text(m), "m.yaml");
  EXPECT_EQ(back.study, m.study);
  EXPECT_EQ(back.structure, m.structure);
  EXPECT_TRUE(back.varied.empty());
  EXPECT_EQ(back.values, m.values);
  EXPECT_EQ(back.sampled, m.sampled);
  EXPECT_EQ(back.features, m.features);
  ASSERT_EQ(back.settings.size(), 2u);
  EXPECT_EQ(back.settings[1].set, m.settings[1].set);
  EXPECT_EQ(back.settings[0].errors.at("lv_ef_percent").bound_percent, 4);
  EXPECT_TRUE(std::isinf(back.settings[1].errors.at("lv_ef_percent").bound));
}

}  // namespace
}  // namespace cohort
