#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "ensemble/campaign.hpp"

namespace cohort {
namespace {

Distribution normal(double mean, double deviation, double lower, double upper) {
  return {.kind = Distribution::Kind::normal,
          .a = mean,
          .b = deviation,
          .lower = lower,
          .upper = upper,
          .choices = {}};
}

TEST(Distribution, UniformEndsAreExact) {
  const Distribution d{.kind = Distribution::Kind::uniform, .a = 0.1, .b = 0.7, .choices = {}};
  EXPECT_EQ(d.value(0), 0.1);
  EXPECT_EQ(d.value(1), 0.7);
  EXPECT_DOUBLE_EQ(d.value(0.5), 0.4);
}

TEST(Distribution, LogUniformHalvesTheRatio) {
  const Distribution d{.kind = Distribution::Kind::log_uniform, .a = 1e-3, .b = 10, .choices = {}};
  EXPECT_DOUBLE_EQ(d.value(0), 1e-3);
  EXPECT_DOUBLE_EQ(d.value(0.5), 0.1);
  EXPECT_DOUBLE_EQ(d.value(1), 10);
  EXPECT_LE(d.value(1), 10);
}

TEST(Distribution, ChoiceSplitsTheUnitIntervalEvenly) {
  const Distribution d{.kind = Distribution::Kind::choice, .choices = {3, 5, 9}};
  EXPECT_EQ(d.value(0), 3);
  EXPECT_EQ(d.value(0.33), 3);
  EXPECT_EQ(d.value(0.34), 5);
  EXPECT_EQ(d.value(0.67), 9);
  EXPECT_EQ(d.value(1), 9);
}

TEST(Distribution, TruncatedNormalEqualsScipy) {
  std::ifstream in(COHORT_SOURCE_DIR "/tests/reference/truncated_normal.csv");
  std::string line;
  int rows = 0;
  while (std::getline(in, line)) {
    if (line.starts_with('#')) continue;
    double x[6];
    char comma;
    std::istringstream cells(line);
    for (double& value : x) cells >> value >> comma;
    const double deviation = x[1];
    EXPECT_NEAR(normal(x[0], deviation, x[2], x[3]).value(x[4]), x[5], 1e-12 * deviation) << line;
    ++rows;
  }
  EXPECT_EQ(rows, 60);
}

TEST(Distribution, TruncatedNormalStaysInsideItsBounds) {
  const auto d = normal(10, 1, 7, 14);
  EXPECT_GE(d.value(0), 7);
  EXPECT_LE(d.value(1), 14);
  double previous = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double value = d.value(i / 1000.0);
    EXPECT_GT(value, previous);
    previous = value;
  }
}

}  // namespace
}  // namespace cohort
