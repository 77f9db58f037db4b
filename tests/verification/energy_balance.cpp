// The energy balance of deforming tissue (solver/energy_balance.hpp): vibration without tension, and
// contraction. What is left is nobody's work, so that it says how well the motion is resolved in time, and
// falls with the distance of the looks.
#include "solver/energy_balance.hpp"

#include <cstdio>

#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

using Kind = Mechanics::Boundary::Kind;

struct Balance {
  double active, on_blood, stored, dissipated, residual;
};

/// A ventricle under a constant pressure, let go from a stretched state where it has no tension, for 100 ms.
struct Case {
  const char* name;
  std::string tension;
  Settings set;
  Precision precision = Precision::double_;
  double pull_mm = 4;
  bool lid_moves = false;
  int look_every = 16;
};

Balance balance(const Case& one) {
  Scene scene = hollow(true, "guccione", one.precision, true);
  scene.pv.emplace();
  scene.mechanics->tension = one.tension;
  scene.mechanics->boundary = {{"base", "below_base", Kind::clamp_normal},
                               {"ring", "below_base", Kind::spring},
                               {"outside", "outer", Kind::spring_normal}};
  if (one.lid_moves) scene.mechanics->boundary = {{"outside", "outer", Kind::spring}};
  Settings set = ellipsoids({20, 20, 60}, 9.5, 5);
  set.insert(set.end(), {{"geometry.shapes.below_base.half_space.point_mm.z", 0},
                         {"mechanics.damping_per_ms", 0},
                         {"mechanics.boundary.outside.damping_kPa_ms_per_mm", 0},
                         {"mechanics.cavities.lv.pressure_kPa", 1.5},
                         {"mechanics.load.ramp_ms", 30},
                         {"time.end_ms", 100}});
  if (!one.lid_moves) set.emplace_back("mechanics.boundary.ring.damping_kPa_ms_per_mm", 0);
  set.insert(set.end(), one.set.begin(), one.set.end());
  SolidRun run(std::move(scene), set);
  EXPECT_EQ(run.solid->defect(0), "");
  if (one.tension.empty())
    run.solid->set_motion(run.field([&](const std::array<double, 3>& X) {
      const double depth = -X[2] / 60;
      return std::array<double, 3>{one.pull_mm * depth * depth, 0.4 * one.pull_mm * depth, 0};
    }),
                          run.at_rest());
  std::vector<double> state = run.solid->state();
  for (int step = 0; state[Solid::ended] == 0; ++step) {
    run.loaded_step(step % one.look_every == 0);
    if (step % 64 == 0) state = run.solid->state();
  }
  EXPECT_EQ(state[Solid::ended], static_cast<double>(SolidEnd::settled));
  const std::vector<float> found = energy_balance(run.scene, state);
  EXPECT_EQ(found.size(), energy_names(run.scene).size());
  const Balance result = {found[0], found[1], found[2], found[3], found[4]};
  std::printf(
      "%-34s every %3d steps: active %8.3f, on blood %8.3f, stored %8.3f, dissipated %7.3f mJ, residual "
      "%9.2e\n",
      one.name, one.look_every, result.active, result.on_blood, result.stored, result.dissipated,
      result.residual);
  return result;
}

const Settings mass = {{"mechanics.damping_per_ms", 0.02}}, stickiness = {{"mechanics.viscosity_kPa_ms", 5}},
               dashpots = {{"mechanics.boundary.ring.damping_kPa_ms_per_mm", 2},
                           {"mechanics.boundary.outside.damping_kPa_ms_per_mm", 2}};

TEST(EnergyBalance, OfVibration) {
  for (const Case& one :
       {Case{"undamped", "", {}}, Case{"undamped, single", "", {}, Precision::single_},
        Case{"mass damped", "", mass}, Case{"dashpots", "", dashpots}, Case{"viscous", "", stickiness}}) {
    const Balance found = balance(one);
    EXPECT_EQ(found.active, 0);
    EXPECT_LT(std::abs(found.residual), 0.01) << one.name;
    EXPECT_GT(std::abs(found.on_blood), 10);
    if (one.set.empty()) {
      EXPECT_EQ(found.dissipated, 0);
    } else {
      EXPECT_GT(found.dissipated, 0.5) << one.name;
    }
  }
}

// A contraction about as fast as the heart's.
Settings contracting(double end_ms = 120) {
  return {{"mechanics.damping_per_ms", 0.1}, {"time.end_ms", end_ms}};
}
Case twitch(Precision precision = Precision::double_) {
  Case one{"twitch", "twitch", contracting(), precision};
  one.set.emplace_back("mechanics.twitch.peak_kPa", 50);
  return one;
}
Case constant() {
  Case one{"constant tension", "constant", contracting()};
  one.set.insert(one.set.end(), {{"mechanics.constant.peak_kPa", 20}, {"mechanics.load.ramp_ms", 60}});
  return one;
}

TEST(EnergyBalance, OfContraction) {
  for (const Case& one : {twitch(), twitch(Precision::single_), constant()}) {
    const Balance found = balance(one);
    EXPECT_GT(found.active, 50) << one.name;
    EXPECT_GT(found.on_blood, 5) << one.name;
    EXPECT_GT(found.stored, 20) << one.name;
    EXPECT_LT(std::abs(found.residual), 0.005) << one.name;
  }
}

// What cells do between the looks; the rest of the residual is of first order in the step.
TEST(EnergyBalance, IsOfSecondOrderInTheLooks) {
  Case one = constant();
  std::vector<double> residuals;
  for (const int every : {1, 8, 16, 32}) {
    one.look_every = every;
    residuals.push_back(balance(one).residual);
  }
  EXPECT_LT(std::abs(residuals[0]), 1e-3);
  const double order = std::log2(std::abs((residuals[3] - residuals[0]) / (residuals[2] - residuals[0])));
  std::printf("order %.2f\n", order);
  EXPECT_GT(order, 1.8);
}

// A ventricle that nothing holds at its base: its lid moves, and the wall works less on the blood than the
// volume says.
TEST(EnergyBalance, OfALidThatMoves) {
  Case one{"lid moves", "", mass};
  one.lid_moves = true;
  one.pull_mm = 0;
  const Balance found = balance(one);
  EXPECT_LT(std::abs(found.residual), 0.01);
}

}  // namespace
}  // namespace cohort::test
