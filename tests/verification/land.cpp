// Land et al. 2015, Proc. R. Soc. A 471:20150641, problems 2 and 3, as the campaigns of configs/ state them.
// Apex positions of a public finite-element code, which lie within 0.5 % of the groups' finest solutions:
// tests/reference/land2015.yaml.
#include "tests/land.hpp"

namespace cohort::test {
namespace {

TEST(Land, InflationComesToThePublishedApexFromAbove) {
  const Apex coarse = land("inflation", 2), fine = land("inflation", 1);
  expect_published_inflation(coarse, fine, 0.01);  // tolerance of voxels with volume fractions at 1 mm
  EXPECT_NEAR(fine.pressure_mmHg, 10 * 7.50062, 1e-3);
}

TEST(Land, ContractionComesToThePublishedApex) {
  const Apex coarse = land("contraction", 2), fine = land("contraction", 1);
  expect_published_contraction(coarse, fine, 0.03);
  EXPECT_GT(coarse.volume_mL, fine.volume_mL);
}

// The tissue is at rest when the campaigns say so: ten times less force out of balance moves no apex by 0.01
// mm.
TEST(Land, TheResidualIsSmallEnough) {
  for (const char* problem : {"inflation", "contraction"})
    for (const double dx : {2.0, 1.0}) {
      const Apex apex = land(problem, dx), rested = land(problem, dx, {"mechanics.load.tolerance=3e-5"});
      EXPECT_NEAR(apex.endocardium, rested.endocardium, 0.01) << problem << " at " << dx;
      EXPECT_NEAR(apex.epicardium, rested.epicardium, 0.01) << problem << " at " << dx;
    }
}

// A point beyond the tissue is told before the run.
TEST(Land, APointOutsideTheTissueIsRefused) {
  EXPECT_THROW(land("inflation", 2, {"outputs.displacement.points.apex_epicardium_mm=[0, 0, -32]"}),
               std::invalid_argument);
}

}  // namespace
}  // namespace cohort::test
