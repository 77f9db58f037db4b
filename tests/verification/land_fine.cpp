// Problems 2 and 3 of Land et al. at 0.5 mm: tests/verification/land.cpp.
#include "tests/land.hpp"

namespace cohort::test {
namespace {

TEST(LandFine, InflationIsWithinHalfAPercent) {
  expect_published_inflation(land("inflation", 1), land("inflation", 0.5), 0.005);
}

TEST(LandFine, ContractionIsWithinOneAndAHalfPercent) {
  expect_published_contraction(land("contraction", 1), land("contraction", 0.5), 0.015);
}

}  // namespace
}  // namespace cohort::test
