// Arithmetic of studies of error against run time, and of the choice by accuracy.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ensemble/feature_names.hpp"
#include "ensemble/measurements.hpp"
#include "ensemble/work_precision_runs.hpp"

namespace cohort {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

TEST(Front, IsWhatNothingBeatsInBoth) {
  const std::vector<double> time = {1, 2, 3, 4, 5}, error = {10, 4, 6, 1, NaN};
  EXPECT_EQ(pareto_front(time, error), (std::vector<bool>{true, true, false, true, false}));
  EXPECT_DOUBLE_EQ(distance_to_front(time, error, 1), 1);
  // 3 s for 6: 2 s give less, so 1.5 in time and in error.
  EXPECT_DOUBLE_EQ(distance_to_front(time, error, 2), 1.5);
  EXPECT_TRUE(std::isnan(distance_to_front(time, error, 4)));
}

TEST(Front, HoldsEqualsAndMeasuresTheNearerWay) {
  EXPECT_EQ(pareto_front({1, 1}, {2, 2}), (std::vector<bool>{true, true}));
  // Ten times as slow, but 5 % from the error of the fast one.
  EXPECT_NEAR(distance_to_front({1, 10}, {1, 1.05}, 1), 1.05, 1e-12);
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

Setting setting(std::vector<std::pair<std::string, std::string>> values) {
  return {"", std::move(values), false};
}

TEST(Order, PairsSettingsThatDifferInOneStep) {
  WorkPrecisionDesign design;
  design.settings = {setting({{"grid.dx_mm", "4"}, {"precision", "single"}}),
                     setting({{"grid.dx_mm", "2"}, {"precision", "single"}}),
                     setting({{"grid.dx_mm", "1"}, {"precision", "single"}}),
                     setting({{"grid.dx_mm", "1"}, {"precision", "double"}})};
  MeasureErrors errors{"x", "1", {{16}, {4}, {1}, {1}}, {}};
  const std::vector<ObservedOrder> orders = observed_orders(design, {errors});
  ASSERT_EQ(orders.size(), 2u);
  for (const ObservedOrder& order : orders) EXPECT_NEAR(order.order, 2, 1e-6);
  EXPECT_EQ(orders[0].coarse, 0u);
  EXPECT_EQ(orders[0].fine, 1u);
  EXPECT_EQ(orders[1].fine, 2u);
}

TEST(Rounding, IsTheWayBetweenTwinsOverTheError) {
  WorkPrecisionDesign design;
  design.settings = {setting({{"grid.dx_mm", "1"}, {"precision", "single"}}),
                     setting({{"grid.dx_mm", "1"}, {"precision", "double"}})};
  std::vector<SettingRun> runs(2);
  for (std::size_t i = 0; i < 2; ++i) {
    runs[i].layout.features = {"x"};
    runs[i].layout.feature_units = {"1"};
    runs[i].recordings.resize(1);
    runs[i].recordings[0].outcome = Outcome::done;
    runs[i].recordings[0].features = {i == 0 ? 1.5f : 1.25f};
  }
  const auto shares = rounding_shares(design, runs, {MeasureErrors{"x", "1", {{0.5}, {0.25}}, {}}});
  ASSERT_EQ(shares.size(), 1u);
  EXPECT_DOUBLE_EQ(shares[0].apart, 0.25);
  EXPECT_DOUBLE_EQ(shares[0].share, 0.5);
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
