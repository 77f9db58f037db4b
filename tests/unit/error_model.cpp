#include "ensemble/error_model.hpp"

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <random>

namespace cohort {
namespace {

struct Checks {
  std::vector<double> points, errors;
};

/// `count` uniform points of `parameters`, errors = constant + slope * first coordinate + noise.
Checks checks(std::mt19937& random, std::size_t count, std::size_t parameters, double constant, double slope,
              double noise) {
  std::uniform_real_distribution<double> number;
  std::normal_distribution<double> normal;
  Checks result;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < parameters; ++j) result.points.push_back(number(random));
    result.errors.push_back(constant + slope * result.points[i * parameters] + noise * normal(random));
  }
  return result;
}

TEST(ErrorOf, IsExactForAnErrorOfItsOrder) {
  const auto feature = [](double h, double order) { return 7 + 0.3 * std::pow(h, order); };
  for (const double order : {1.0, 2.0}) {
    const double h = 0.5, error = error_of(feature(h, order), feature(h / 2, order), order);
    EXPECT_NEAR(feature(h, order) - error, 7, 1e-14);
  }
  // An error of second order that is taken for one of first is estimated half as large again.
  EXPECT_NEAR(error_of(feature(1, 2), feature(0.5, 2), 1), 1.5 * 0.3, 1e-14);
}

TEST(ErrorModel, RecoversAPlantedPlane) {
  std::mt19937 random(1);
  const auto [points, errors] = checks(random, 24, 4, -2, 6, 0.05);
  const ErrorModel model(points, 4, errors);
  EXPECT_EQ(model.kind(), ErrorModelKind::linear);
  EXPECT_LT(model.left_out_rms(), 0.1);
  EXPECT_GT(model.left_out_rms_constant(), 1);
  double squares = 0;
  const auto others = checks(random, 200, 4, -2, 6, 0);
  for (std::size_t i = 0; i < 200; ++i)
    squares += std::pow(model.at(std::span(others.points).subspan(4 * i, 4)) - others.errors[i], 2);
  EXPECT_LT(std::sqrt(squares / 200), 0.15);  // within its noise and the bounds on what it may tell
}

TEST(ErrorModel, LeftOutIsWhatAModelWithoutThatCheckMisses) {
  std::mt19937 random(2);
  const auto [points, errors] = checks(random, 20, 2, 1, 3, 0.2);
  const ErrorModel model(points, 2, errors);
  ASSERT_EQ(model.kind(), ErrorModelKind::linear);
  double squares = 0, of_constant = 0;
  for (std::size_t out = 0; out < 20; ++out) {
    std::vector<double> some_points, some_errors;
    double mean = 0;
    for (std::size_t i = 0; i < 20; ++i) {
      if (i == out) continue;
      some_points.insert(some_points.end(), points.begin() + static_cast<std::ptrdiff_t>(2 * i),
                         points.begin() + static_cast<std::ptrdiff_t>(2 * i + 2));
      some_errors.push_back(errors[i]);
      mean += errors[i] / 19;
    }
    const ErrorModel without(some_points, 2, some_errors);
    squares += std::pow(without.at(std::span(points).subspan(2 * out, 2)) - errors[out], 2);
    of_constant += std::pow(mean - errors[out], 2);
  }
  EXPECT_NEAR(model.left_out_rms_constant(), std::sqrt(of_constant / 20), 1e-12);
  // The ridge weighs as a share of the checks, of which one fewer is a little less.
  EXPECT_NEAR(model.left_out_rms(), std::sqrt(squares / 20), 0.01 * model.left_out_rms());
}

TEST(ErrorModel, NoiseIsAConstant) {
  std::mt19937 random(3);
  struct Case {
    std::size_t count, parameters;
    int least;  // of a thousand campaigns
  };
  for (const auto& [count, parameters, least] :
       {Case{3, 1, 1000}, Case{4, 2, 1000}, Case{7, 5, 1000}, Case{10, 5, 1000}, Case{10, 1, 950},
        Case{10, 4, 880}, Case{12, 5, 900}, Case{20, 5, 950}, Case{100, 5, 980}}) {
    int constants = 0;
    constexpr int campaigns = 1000;
    for (int i = 0; i < campaigns; ++i) {
      const auto [points, errors] = checks(random, count, parameters, 1, 0, 1);
      const ErrorModel model(points, parameters, errors);
      constants += model.kind() == ErrorModelKind::constant;
    }
    RecordProperty(fmt::format("constants_with_{}_of_{}", count, parameters), constants);
    EXPECT_GE(constants, least) << count << " checks, " << parameters << " parameters";
  }
}

TEST(ErrorModel, TellsNothingFarFromWhatWasSeen) {
  // A plane through points in the middle, asked for its corners.
  std::vector<double> points, errors;
  for (int i = 0; i <= 10; ++i) {
    points.push_back(0.45 + 0.01 * i);
    errors.push_back(i);
  }
  const ErrorModel model(points, 1, errors);
  ASSERT_EQ(model.kind(), ErrorModelKind::linear);
  EXPECT_NEAR(model.at(std::vector{0.5}), 5, 1e-9);
  EXPECT_EQ(model.at(std::vector{0.0}), -2.5);
  EXPECT_EQ(model.at(std::vector{1.0}), 12.5);
}

TEST(ErrorModel, NeedsTwoChecksAndForAPlaneTenAndTwiceTheParameters) {
  const std::vector<double> place(1, 0.5);
  EXPECT_EQ(ErrorModel({}, 1, {}).kind(), ErrorModelKind::none);
  const ErrorModel one(place, 1, std::vector{3.0});
  EXPECT_EQ(one.kind(), ErrorModelKind::none);
  EXPECT_TRUE(std::isnan(one.at(place)) && std::isnan(one.left_out_rms()));
  const ErrorModel two(std::vector{0.0, 1.0}, 1, std::vector{3.0, 5.0});
  EXPECT_EQ(two.kind(), ErrorModelKind::constant);
  EXPECT_EQ(two.at(place), 4);
  EXPECT_EQ(two.left_out_rms(), 2);

  std::mt19937 random(4);
  for (const auto& [parameters, least] : {std::pair<std::size_t, std::size_t>{1, 10}, {4, 10}, {7, 16}}) {
    const auto few = checks(random, least - 1, parameters, 0, 1, 0),
               enough = checks(random, least, parameters, 0, 1, 0);
    EXPECT_EQ(ErrorModel(few.points, parameters, few.errors).kind(), ErrorModelKind::constant);
    EXPECT_EQ(ErrorModel(enough.points, parameters, enough.errors).kind(), ErrorModelKind::linear);
  }
  // Without a parameter, and with one that no check varies.
  EXPECT_EQ(ErrorModel({}, 0, std::vector{1.0, 2.0, 3.0}).at({}), 2);
  const ErrorModel alike(std::vector(4, 0.3), 1, std::vector{1.0, 2.0, 3.0, 4.0});
  EXPECT_EQ(alike.kind(), ErrorModelKind::constant);
  EXPECT_EQ(alike.at(place), 2.5);
}

TEST(ErrorModel, NoErrorIsAConstant) {
  const ErrorModel model(std::vector{0.1, 0.2, 0.6, 0.9}, 1, std::vector(4, 0.0));
  EXPECT_EQ(model.kind(), ErrorModelKind::constant);
  EXPECT_EQ(model.at(std::vector{0.5}), 0);
  EXPECT_EQ(model.left_out_rms(), 0);
}

}  // namespace
}  // namespace cohort
