// Arostica et al. 2025, Comput. Methods Appl. Mech. Eng. 435:117485, the monoventricle of
// configs/arostica.yaml on a coarse grid.
#include <cmath>
#include <numbers>

#include "tests/campaign_run.hpp"

namespace cohort {
namespace {

/// The benchmark's pressure (Pa) at `end_s`, its specification in SI, by a plain Euler method of small steps.
double pressure_Pa(double end_s) {
  const auto up = [](double x) { return 0.5 * (1 + std::tanh(x / 0.005)); };
  const auto down = [](double x) { return 0.5 * (1 - std::tanh(x / 0.005)); };
  constexpr double step = 1e-6;
  double p = 0;
  for (double t = 0; t < end_s; t += step) {
    const double f = up(t - 0.17) * down(t - 0.484), g = down(t - 0.484);
    const double b = 5 * f - 30 * (1 - f) + 5 * g + 1;
    p += step * (-std::abs(b) * p + 16000 * std::max(b, 0.0) + 7000 * std::max(g, 0.0));
  }
  return p;
}

// Filling and the begin of contraction.
TEST(Arostica, FillsUnderThePrescribedPressure) {
  const test::CampaignRun run("configs/arostica.yaml", {"grid.dx_mm=6", "time.end_ms=200"});
  const Recording& recording = run.recording();
  ASSERT_EQ(recording.outcome, Outcome::done) << recording.reason;
  ASSERT_EQ(recording.volume.size(), 200u);
  ASSERT_EQ(recording.displacement.size(), 2u * 3 * 200);
  for (const int ms : {50, 100, 150, 199})
    EXPECT_NEAR(recording.pressure[static_cast<std::size_t>(ms)] / 7.50061683 * 1000, pressure_Pa(1e-3 * ms),
                0.001 * pressure_Pa(1e-3 * ms))
        << ms;
  // Volume of the cut ellipsoid: pi a^2 (2 c / 3 + h - h^3 / (3 c^2)).
  const double c = 90, h = 90. * 5 / 17,
               volume = std::numbers::pi * 625 * (2 * c / 3 + h - h * h * h / (3 * c * c)) / 1000;
  EXPECT_NEAR(recording.volume[0], volume, 0.01 * volume);
  EXPECT_GT(recording.volume[150], recording.volume[0] + 1);
  // The base moves away from the apex as the ventricle fills.
  const auto along_axis = [&](std::size_t point, std::size_t ms) {
    return recording.displacement[(point * 3 + 2) * 200 + ms];
  };
  EXPECT_EQ(along_axis(0, 0), 0);
  EXPECT_GT(along_axis(0, 150), 0.3f);
  for (std::size_t ms = 1; ms < 200; ++ms)
    EXPECT_LT(std::abs(along_axis(0, ms) - along_axis(0, ms - 1)), 0.5f) << ms;
}

// What a viscous neighbour does to the step and the kernels does not reach others.
TEST(Arostica, ABatchChangesNothing) {
  const Campaign campaign = read_campaign(std::string(COHORT_SOURCE_DIR) + "/configs/arostica.yaml",
                                          {"grid.dx_mm=8", "time.end_ms=20"});
  Member viscous{0, campaign.scene.parameters.values()}, other{1, viscous.values};
  campaign.scene.parameters.resolve(viscous.values);
  other.values[static_cast<std::size_t>(campaign.scene.parameters.index("mechanics.viscosity_kPa_ms"))] = 0;
  campaign.scene.parameters.resolve(other.values);
  const std::vector<Member> both = {viscous, other};
  const auto run = [&](std::span<const Member> members) {
    const Plan plan = make_plan(test::device(), campaign.scene, both, {});
    Simulation simulation(test::device(), campaign.scene, plan);
    return simulation.run(members, 600).back();
  };
  PlanOptions two;
  two.members_per_device = 2;
  const Plan plan = make_plan(test::device(), campaign.scene, both, two);
  EXPECT_TRUE(plan.viscous);
  Simulation simulation(test::device(), campaign.scene, plan);
  const std::vector<Recording> together = simulation.run(both, 600);
  const Recording alone = run(std::span(both).subspan(1, 1));
  ASSERT_EQ(alone.outcome, Outcome::done) << alone.reason;
  EXPECT_EQ(together[1].displacement, alone.displacement);
  EXPECT_EQ(together[1].volume, alone.volume);
  EXPECT_EQ(together[1].pressure, alone.pressure);
  EXPECT_NE(together[0].volume, together[1].volume);
}

}  // namespace
}  // namespace cohort
