// The beating heart with four chambers of tissue (configs/whole_heart.yaml) against what is normal in healthy
// adults: at 4 mm on a CPU, at 2 mm on a GPU. Minutes on a CPU.
#include "solver/mechanics_structure.hpp"
#include "tests/heart_run.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

const std::string whole = "whole_heart.yaml";

TEST(HeartAtria, BeatAsThoseOfAHealthyAdult) {
  const Beat beat = test::beat({at(spacing())}, {}, whole)[0];
  ASSERT_EQ(beat.recording.outcome, Outcome::done) << beat.recording.reason;
  expect_healthy(beat);
  for (const char* name : {"beats", "beat_difference", "valve_switches", "ringing_mmHg", "blood_apart_mL",
                           "smallest_volume_ratio"})
    std::printf("%-36s %9.4f\n", name, beat.feature.at(name));
  EXPECT_LE(beat.feature.at("beat_difference"), 0.01);
  EXPECT_GE(beat.feature.at("valve_switches"), 8);
  EXPECT_LE(beat.feature.at("valve_switches"), 20);
  EXPECT_LE(beat.feature.at("ringing_mmHg"), 0.2);
  EXPECT_LE(beat.feature.at("blood_apart_mL"), 1e-4 * beat.feature.at("lv_edv_mL"));
  EXPECT_GE(beat.feature.at("smallest_volume_ratio"), 0.5);
  // Atria contract before the ventricles: the left one's least pressure after its contraction lies in
  // ventricular systole, and it empties twice, early in diastole and by contraction.
  const std::size_t samples = beat.recording.volume.size() / 6;
  const auto volume = [&](std::size_t chamber, std::size_t ms) {
    return static_cast<double>(beat.recording.volume[chamber * samples + ms]);
  };
  for (const std::size_t atrium : {2, 3}) {
    const auto first = beat.recording.volume.begin() + static_cast<std::ptrdiff_t>(atrium * samples);
    const auto least = static_cast<std::size_t>(std::min_element(first + 100, first + 300) - first);
    EXPECT_GT(volume(atrium, 40) - volume(atrium, least), 5) << "of contraction";
    const auto fullest = static_cast<std::size_t>(std::max_element(first + 300, first + 700) - first);
    EXPECT_GT(volume(atrium, fullest) - volume(atrium, fullest + 60), 5) << "early in diastole";
  }
}

TEST(HeartAtria, DoNotDependOnTheirNeighbour) {
  const std::vector<std::string> coarse = {at(6), "time.beats.at_most=1", "time.beats.length_ms=250"};
  const std::vector<std::pair<std::string, double>> other = {{"mechanics.regions.la.peak_kPa", 20},
                                                             {"geometry.heart.la_radius_mm.y", 24}};
  const std::vector<Beat> both = beat(coarse, other, whole);
  const Beat alone = beat(coarse, {}, whole)[0];
  ASSERT_EQ(alone.recording.outcome, Outcome::done) << alone.recording.reason;
  EXPECT_EQ(both[0].recording.pressure, alone.recording.pressure);
  EXPECT_EQ(both[0].recording.volume, alone.recording.volume);
  ASSERT_EQ(both[1].recording.outcome, Outcome::done) << both[1].recording.reason;
  const std::size_t end_of_la = alone.recording.volume.size() / 6 * 3 - 1;
  EXPECT_GT(std::abs(both[1].recording.volume[end_of_la] - alone.recording.volume[end_of_la]), 1);
}

// One atrium of tissue in a loop of elastances.
TEST(HeartAtria, OneByItselfBeatsWithElastances) {
  const Beat beat =
      test::beat({at(4), "mechanics.cavities=[la]", "time.beats.at_most=8", "time.beats.until_periodic=0.02"},
                 {}, whole)[0];
  ASSERT_EQ(beat.recording.outcome, Outcome::done) << beat.recording.reason;
  for (const char* name : {"lv_edv_mL", "lv_ef_percent", "la_volume_max_mL", "la_mean_mmHg",
                           "la_figure_of_eight", "valve_switches", "blood_apart_mL"})
    std::printf("%-36s %9.4f\n", name, beat.feature.at(name));
  EXPECT_EQ(beat.feature.at("la_figure_of_eight"), 1);
  EXPECT_LE(beat.feature.at("valve_switches"), 20);
  EXPECT_LE(beat.feature.at("blood_apart_mL"), 0.01);
}

// Thin walls under the pressures of a full atrium (9 and 4.5 mmHg): what a grid of one cell to a wall gets
// wrong.
TEST(HeartAtria, FillConvergesWithTheGrid) {
  Scene still;
  Mechanics& mechanics = still.mechanics.emplace();
  mechanics.quasi_static = true;
  mechanics.cavities = {{"la", {}}, {"ra", {}}};
  mechanics.boundary = default_heart_boundary(mechanics);
  const auto pressure = [](const std::string& cavity) {
    return "mechanics.cavities." + cavity + ".pressure_kPa";
  };
  const auto volumes = [](SolidRun& run) {
    const std::vector<double> S = run.solid->state();
    return std::array{S[Solid::first_volume] / 1000, S[Solid::first_volume + 1] / 1000};
  };
  std::vector<std::array<double, 2>> gained;
  for (const double dx : {4.0, 3.0, 2.0}) {
    SolidRun run(still, {{"grid.dx_mm", dx},
                         {"geometry.heart.av_plate_mm", dx == 3 ? 3 : 4},
                         {pressure("la"), 1.2},
                         {pressure("ra"), 0.6}});
    run.measured(run.at_rest());
    const std::array<double, 2> empty = volumes(run);
    run.set(run.at_rest(), run.at_rest(), 0);
    run.solid->set_state(run.start);
    constexpr int most = 20000, between = 16, look = 64;
    double ended = 0;
    for (int step = 0; step < most && ended == 0; ++step) {
      run.loaded_step(step % between == 0);
      if ((step + 1) % look == 0) ended = run.solid->state()[Solid::ended];
    }
    ASSERT_EQ(static_cast<SolidEnd>(static_cast<int>(ended)), SolidEnd::settled);
    const std::array<double, 2> full = volumes(run);
    gained.push_back({full[0] - empty[0], full[1] - empty[1]});
    std::printf("%g mm, %d cells: la %.2f -> %.2f mL, ra %.2f -> %.2f\n", dx, run.mesh().tissue_cells[0],
                empty[0], full[0], empty[1], full[1]);
  }
  for (std::size_t q = 0; q < 2; ++q) {
    EXPECT_NEAR(gained[0][q] / gained[2][q], 1, 0.15);
    EXPECT_NEAR(gained[1][q] / gained[2][q], 1, 0.08);
    EXPECT_LT(std::abs(gained[1][q] - gained[2][q]), std::abs(gained[0][q] - gained[2][q]));
  }
}

}  // namespace
}  // namespace cohort::test
