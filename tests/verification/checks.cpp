// What every row that is done has been checked for: kernels with a fault each, which only the check can tell.
#include "tests/heart_run.hpp"
#include "tests/kernel_copy.hpp"

namespace cohort::test {
namespace {

Recording run(const std::string& file, const std::vector<std::string>& changes) {
  return beat(changes, {}, file)[0].recording;
}
const std::vector<std::string> slab = {"time.end_ms=30", "grid.dx_mm=1",
                                       "electrophysiology.activation=monodomain"};

void expect_unstable(const Recording& recording, const std::vector<std::string>& parts) {
  EXPECT_EQ(recording.outcome, Outcome::unstable) << recording.reason;
  for (const std::string& part : parts)
    EXPECT_NE(recording.reason.find(part), std::string::npos) << recording.reason;
  std::printf("%s\n", recording.reason.c_str());
}

TEST(Checks, NoneFailsWithoutAFault) {
  const Recording recording = run("slab.yaml", slab);
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
}

TEST(Checks, AGateBeyondZeroAndOne) {
  const FaultyKernels faulty("cells/mitchell_schaeffer.cl", "state[S_h] = h_end;",
                             "state[S_h] = h_end + R(0.001) * dt;");
  expect_unstable(run("slab.yaml", slab),
                  {"state h of the cells is beyond what it can be, at (", ") mm, region ", " ms"});
}

TEST(Checks, APotentialOutOfBounds) {
  const FaultyKernels faulty(
      "cells/mitchell_schaeffer.cl", "slope_middle, *V);",
      "slope_middle, *V);\n  *V = WHERE(isgreater(middle, (realv)(R(0.5))), (realv)(R(250.0)), *V);");
  expect_unstable(run("slab.yaml", slab),
                  {"the potential is out of bounds, or no number, in ", " cells, at ", " ms; first 2",
                   " mV at (0.5, 0.5, 0.5) mm, region tissue, beyond -190 to 196.4 mV"});
}

// A coupling that is not the same from both sides.
TEST(Checks, ChargeThatComesFromNowhere) {
  const FaultyKernels faulty("diffusion.clh", "s1 = LOAD(x + i + 1) *", "s1 = R(1.001) * LOAD(x + i + 1) *");
  expect_unstable(run("slab.yaml", slab),
                  {"charge is not conserved: 0.000", " of what diffusion moves is left over, at 30 ms"});
}

TEST(Checks, BloodThatComesFromNowhere) {
  const FaultyKernels faulty("circulation.clh", "s->volume[node] = add_kept(",
                             "s->volume[node] = W(0.00001) + add_kept(");
  expect_unstable(run("circulation.yaml", {}),
                  {"blood is not conserved: ", " mL more in the loop than at its start, at "});
}

TEST(Checks, EnergyThatComesFromNowhere) {
  const FaultyKernels faulty("solid_energy.clh", "S[ACTIVE_WORK] += active;",
                             "S[ACTIVE_WORK] += (wide)1.2f * active;");
  expect_unstable(run("heart.yaml", {at(8), "time.beats.at_most=1"}),
                  {"the energy of the tissue does not balance: 0.1", " of it is left over, at "});
}

TEST(Checks, WeightsThatDoNotSumUpToNothing) {
  const FaultyKernels faulty("lead_weights.cl", "STORE(LOAD(lead) + w[e], lead);",
                             "STORE(LOAD(lead) + fabs(w[e]), lead);");
  const Recording recording = run("ecg.yaml", {at(5), "time.end_ms=10"});
  EXPECT_EQ(recording.outcome, Outcome::rejected);
  EXPECT_EQ(recording.reason.find("the lead fields are not in balance: "), 0u) << recording.reason;
}

}  // namespace
}  // namespace cohort::test
