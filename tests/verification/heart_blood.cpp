// Blood of the beating heart of configs/heart.yaml, coarse: all compartments of the loop, with the cavities
// of tissue in the place of the two chambers they are.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ensemble/config.hpp"
#include "solver/pv_output.hpp"
#include "tests/excited_solid.hpp"

namespace cohort::test {
namespace {

constexpr std::size_t compartments =
    8;  // nodes of the loop, kernels/circulation.clh; the first two of tissue

struct Blood {
  double beat = 0, time_ms = 0;      ///< beats completed, of the beat
  double outside = 0, cavities = 0;  ///< mL: all but the ventricles, the ventricles of tissue
  double total() const { return outside + cavities; }
};

/// Beats to their end; blood every few steps.
std::vector<Blood> blood_of_beats(int beats) {
  Scene scene =
      read_campaign(COHORT_SOURCE_DIR "/configs/heart.yaml", {"grid.dx_mm=6", "time.beats.until_periodic=0",
                                                              "time.beats.at_most=" + std::to_string(beats)})
          .scene;
  scene.ecg.reset();
  ExcitedSolid heart(scene);
  Launcher& launcher = heart.launcher;
  Solid& solid = heart.solid;
  const cl::Buffer& parameters = heart.excitation.parameters;
  solid.activate(heart.brought_over(
      heart.excitation.eikonal->activation(heart.excitation.tissue, std::numeric_limits<float>::max())));
  const auto samples = static_cast<int>(pv_times_ms(scene).size());
  LumpedCirculation circulation(launcher, scene, 1, static_cast<std::size_t>(samples));
  circulation.initialise(parameters, 1);

  constexpr int steps_per_look = 16;
  std::vector<Blood> result;
  std::vector<double> state;
  for (int step = 0; state.empty() || state[Solid::ended] == 0; ++step) {
    const bool look = step % steps_per_look == 0;
    solid.forces(parameters);
    if (look) solid.measure(parameters);
    solid.predict(true);
    std::vector<double> loop(compartments);
    // The loop at the step's beginning; its state begins with the volumes (kernels/beats.clh,
    // circulation.clh).
    if (look)
      launcher.queue().enqueueReadBuffer(circulation.states(), CL_TRUE, 0, loop.size() * sizeof(double),
                                         loop.data());
    const bool begun = !state.empty() && state[Solid::beat_time] >= 0;
    solid.beat(parameters, circulation, samples, true, look);
    if (look) {
      state = solid.state();
      Blood blood{state[Solid::beat_number], state[Solid::beat_time]};
      for (std::size_t i = 2; i < compartments; ++i) blood.outside += loop[i];
      for (int q = 0; q < 2; ++q)
        blood.cavities += state[static_cast<std::size_t>(Solid::first_volume + q)] / 1000;
      if (begun && state[Solid::ended] == 0) result.push_back(blood);
    }
    solid.move();
  }
  EXPECT_EQ(state[Solid::ended], static_cast<double>(SolidEnd::settled));
  EXPECT_EQ(circulation.status()[0].beats, beats);
  return result;
}

TEST(HeartBlood, IsConservedOverTheBeats) {
  if (!device().has_double()) GTEST_SKIP() << "reads the loop's state as double";
  const std::vector<Blood> blood = blood_of_beats(2);
  ASSERT_GT(blood.size(), 200u);
  const double first = blood.front().total();
  double least = first, most = first, least_out = first, most_out = 0, drift = 0;
  for (const Blood& b : blood) {
    least = std::min(least, b.total());
    most = std::max(most, b.total());
    least_out = std::min(least_out, b.outside);
    most_out = std::max(most_out, b.outside);
  }
  drift = blood.back().total() / first - 1;
  std::printf(
      "%zu looks over %.0f beats: blood %.5f mL, %.2e to %.2e of it apart, %.2e at the end; outside the "
      "ventricles %.1f to %.1f mL\n",
      blood.size(), blood.back().beat + 1, first, least / first - 1, most / first - 1, drift, least_out,
      most_out);
  EXPECT_GT(most_out - least_out, 100);  // two strokes leave the ventricles
  EXPECT_LT(most / first - 1, 1e-4);
  EXPECT_GT(least / first - 1, -1e-4);
}

}  // namespace
}  // namespace cohort::test
