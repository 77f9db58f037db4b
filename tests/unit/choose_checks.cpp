#include "ensemble/choose_checks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "ensemble/half_steps.hpp"
#include "ensemble/schema.hpp"
#include "tests/campaign_run.hpp"
#include "tests/robustness/fake_campaign.hpp"

namespace cohort {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// Uniform points in the unit cube.
Samples uniform(std::size_t members, std::size_t parameters) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number;
  Samples samples;
  for (std::size_t i = 0; i < parameters; ++i) samples.paths.push_back("p" + std::to_string(i));
  for (std::size_t i = 0; i < members * parameters; ++i) samples.unit.push_back(number(random));
  samples.physical = samples.unit;
  return samples;
}

double least_distance(const Samples& samples, const std::vector<std::int64_t>& members) {
  const std::size_t width = samples.paths.size();
  double least = std::numeric_limits<double>::infinity();
  for (const auto a : members)
    for (const auto b : members) {
      if (a >= b) continue;
      double sum = 0;
      for (std::size_t i = 0; i < width; ++i)
        sum += std::pow(samples.unit[static_cast<std::size_t>(a) * width + i] -
                            samples.unit[static_cast<std::size_t>(b) * width + i],
                        2);
      least = std::min(least, std::sqrt(sum));
    }
  return least;
}

TEST(ChooseChecks, AHalfIsRoundedUpAndThreeAreTheLeast) {
  Campaign campaign;
  const auto count = [&](double fraction, std::int64_t members) {
    campaign.check_fraction = fraction;
    campaign.members = members;
    return check_count(campaign);
  };
  EXPECT_EQ(count(0.02, 1), 0);
  EXPECT_EQ(count(0.02, 24), 0);
  EXPECT_EQ(count(0.02, 25), 3);
  EXPECT_EQ(count(0.3, 2), 2);
  EXPECT_EQ(count(0.3, 4), 3);
  EXPECT_EQ(count(0.02, 174), 3);
  EXPECT_EQ(count(0.02, 175), 4);
  EXPECT_EQ(count(0.02, 10'000), 200);
  EXPECT_EQ(count(0.07, 50), 4);
  EXPECT_EQ(count(0, 10'000), 0);
  EXPECT_EQ(count(1, 1), 1);
  EXPECT_EQ(count(1, 7), 7);
}

TEST(ChooseChecks, AreSpreadBetterThanAtRandom) {
  const Samples samples = uniform(1000, 5);
  const auto chosen = choose_checks(samples, 1000, 20);
  ASSERT_EQ(chosen.size(), 20u);
  std::mt19937 random(5);
  std::vector<std::int64_t> all(1000);
  std::iota(all.begin(), all.end(), 0);
  double best_of_random = 0, sum = 0;
  constexpr int draws = 1000;
  for (int draw = 0; draw < draws; ++draw) {
    std::vector<std::int64_t> some;
    std::sample(all.begin(), all.end(), std::back_inserter(some), 20, random);
    best_of_random = std::max(best_of_random, least_distance(samples, some));
    sum += least_distance(samples, some);
  }
  EXPECT_GT(least_distance(samples, chosen), best_of_random);
  EXPECT_GT(least_distance(samples, chosen), 2 * sum / draws);
}

TEST(ChooseChecks, OneIsTheMemberNearestToTheMiddle) {
  Samples samples{{"a", "b"}, {0, 0, 0.4, 0.5, 1, 1, 0.5, 0.8}, {}};
  samples.physical = samples.unit;
  EXPECT_EQ(choose_checks(samples, 4, 1), std::vector<std::int64_t>{1});
  EXPECT_EQ(choose_checks(samples, 4, 0), std::vector<std::int64_t>{});
}

TEST(ChooseChecks, AnyNumberIsChosenOnceAndInOrder) {
  for (const std::int64_t members : {1, 7, 300, 1023, 2000})
    for (const std::int64_t count : {std::int64_t{1}, members / 3, members - 1, members}) {
      const auto chosen = choose_checks(uniform(static_cast<std::size_t>(members), 2), members, count);
      EXPECT_EQ(std::ssize(chosen), count) << members;
      EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
      EXPECT_EQ(std::set(chosen.begin(), chosen.end()).size(), chosen.size()) << members << " " << count;
      for (const auto member : chosen) EXPECT_TRUE(member >= 0 && member < members);
    }
}

TEST(ChooseChecks, MembersWithoutParametersOrAllAlikeAreTakenFromTheFirst) {
  EXPECT_EQ(choose_checks({}, 5, 2), (std::vector<std::int64_t>{0, 1}));
  const Samples alike{{"a"}, {0.3, 0.3, 0.3}, {1, 1, 1}};
  EXPECT_EQ(choose_checks(alike, 3, 2), (std::vector<std::int64_t>{0, 1}));
}

TEST(ChooseChecks, PointsOfAFileAreScaledByTheirRange) {
  // Where the first column alone counted, which is a thousand times wider, rows 0 and 1 would stay together.
  const Samples samples{{"a", "b"}, std::vector<double>(8, NaN), {1000, 1, 1100, 2, 3000, 1.5, 2000, 1.4}};
  const std::vector<double> expected{0, 0, 0.05, 1, 1, 0.5, 0.5, 0.4};
  const auto points = unit_points(samples, 4);
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(points[i], expected[i], 1e-15);
  EXPECT_EQ(choose_checks(samples, 4, 3), (std::vector<std::int64_t>{0, 1, 3}));
}

TEST(HalfSteps, HalveWhatIsGivenAndLeaveTheTorso) {
  const Campaign campaign = test::campaign_of(
      "heart.yaml", {"grid.dx_mm=2", "mechanics.dx_mm=4", "torso.dx_mm=10", "geometry.heart.lv_wall_mm=11"});
  const Scene fine = half_steps(campaign.scene);
  const auto value = [&](const char* path) { return fine.parameters.value(path); };
  EXPECT_EQ(value("grid.dx_mm"), 1);
  EXPECT_EQ(value("mechanics.dx_mm"), 2);
  EXPECT_EQ(value("torso.dx_mm"), 10);
  EXPECT_EQ(value("geometry.heart.lv_wall_mm"), 11);
  const Member member = half_steps(campaign.scene, members(campaign).front());
  EXPECT_EQ(member.values[static_cast<std::size_t>(fine.parameters.index("grid.dx_mm"))], 1);
  EXPECT_EQ(member.values[static_cast<std::size_t>(fine.parameters.index("geometry.heart.lv_wall_mm"))], 11);
}

/// The step of a circulation: what is given, times its factor where there is one.
double circulation_step_ms(const ParameterTable& table) {
  const int factor = table.find("time.step_factor");
  return table.value("circulation.dt_ms") * (factor < 0 ? 1 : table[factor].value);
}

TEST(HalfSteps, OfACirculationIsItsStep) {
  const Campaign campaign = test::campaign_of("circulation.yaml", {"circulation.dt_ms=0.4"});
  EXPECT_DOUBLE_EQ(circulation_step_ms(half_steps(campaign.scene).parameters), 0.2);
}

TEST(HalfSteps, BeatsAgreeToAQuarterWithinTwiceAsManyUnlessTheirNumberIsGiven) {
  const auto rule = [](double until, double at_most) {
    const Campaign campaign =
        test::campaign_of("circulation.yaml", {"time.beats.until_periodic=" + std::to_string(until),
                                               "time.beats.at_most=" + std::to_string(at_most)});
    const ParameterTable fine = half_steps(campaign.scene).parameters;
    EXPECT_EQ(half_steps(campaign.scene, members(campaign).front())
                  .values[static_cast<std::size_t>(fine.index("time.beats.until_periodic"))],
              fine.value("time.beats.until_periodic"));
    return std::pair(fine.value("time.beats.until_periodic"), fine.value("time.beats.at_most"));
  };
  EXPECT_EQ(rule(0.01, 10), std::pair(0.0025, 20.0));
  EXPECT_EQ(rule(0.01, 6000), std::pair(0.0025, 6000.0));  // 10000 are the most
  EXPECT_EQ(rule(0.01, 1), std::pair(0.01, 1.0));
  EXPECT_EQ(rule(0, 7), std::pair(0.0, 7.0));
}

TEST(ChecksSchema, HoldsTheRowsOfTheMembersThatAreChecked) {
  const auto campaign = fake::campaign(64);
  const auto schema = make_schema(campaign, sample(campaign), fake::layout(), "test");
  const auto checks = checks_schema(schema);
  ASSERT_EQ(checks.members, 6);
  EXPECT_EQ(checks.member_of_check, schema.checked);
  for (std::size_t check = 0; check < 6; ++check)
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_EQ(checks.samples.physical[2 * check + i],
                schema.samples.physical[2 * static_cast<std::size_t>(schema.checked[check]) + i]);
  EXPECT_TRUE(checks.layout.leads.empty());
  EXPECT_EQ(checks.layout.features, schema.layout.features);
}

}  // namespace
}  // namespace cohort
