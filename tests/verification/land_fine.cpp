// Problems 2 and 3 of Land et al. at 0.5 mm: tests/verification/land.cpp.
#include "tests/land.hpp"

namespace cohort {
namespace {

using test::Apex;
using test::land;

TEST(LandFine, InflationIsWithinHalfAPercent) {
  const Apex middle = land("inflation", 1), fine = land("inflation", 0.5);
  EXPECT_NEAR(fine.endocardium, -26.533, 0.005 * 26.533);
  EXPECT_NEAR(fine.epicardium, -28.179, 0.005 * 28.179);
  EXPECT_LT(fine.endocardium, middle.endocardium);
  EXPECT_LT(fine.epicardium, middle.epicardium);
  EXPECT_LT(middle.volume_mL, fine.volume_mL);
}

TEST(LandFine, ContractionIsWithinOneAndAHalfPercent) {
  const Apex middle = land("contraction", 1), fine = land("contraction", 0.5);
  EXPECT_GT(fine.endocardium, -12.5 * 1.015);
  EXPECT_LT(fine.endocardium, -11.99 * 0.985);
  EXPECT_GT(fine.epicardium, -15.5 * 1.015);
  EXPECT_LT(fine.epicardium, -15.22 * 0.985);
  EXPECT_LT(fine.endocardium, middle.endocardium);
  EXPECT_GT(fine.epicardium, middle.epicardium);
}

}  // namespace
}  // namespace cohort
