#include "solver/pv_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "solver/loop_lobes.hpp"

// Loops of straight lines whose features are known exactly, and what has none.
namespace cohort {
namespace {

constexpr double beat_ms = 800;
constexpr float NaN = std::numeric_limits<float>::quiet_NaN();

/// Through the points (time, value), linear in between.
float on_line(const std::vector<std::pair<double, double>>& points, double time) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    const auto [t0, x0] = points[i - 1];
    const auto [t1, x1] = points[i];
    if (time <= t1) return static_cast<float>(x0 + (time - t0) / (t1 - t0) * (x1 - x0));
  }
  return static_cast<float>(points.back().second);
}

using Line = std::vector<std::pair<double, double>>;

// The mitral valve closes at 101 ms and opens at 399, the aortic one opens at 136 and closes at 364.
const Line lv_pressure = {{0, 8}, {100, 8}, {150, 108}, {350, 108}, {400, 8}, {800, 8}};
const Line lv_volume = {{0, 110}, {101, 120}, {136, 120}, {364, 50}, {399, 50}, {800, 110}};
const Line la_pressure = {{0, 10}, {800, 10}};
const Line aortic_pressure = {{0, 80}, {800, 80}};

struct Heart {
  std::vector<std::string> compartments = {"LV", "LA", "aorta"};
  std::vector<float> pressure, volume;
  double interval_ms = 1, beat = beat_ms, filling_mmHg = std::numeric_limits<double>::quiet_NaN();

  std::size_t samples() const { return pressure.size() / compartments.size(); }

  std::map<std::string, float> features() const {
    const auto names = pv_feature_names(compartments);
    const auto values = pv_features({compartments, pressure, volume, interval_ms, beat, filling_mmHg});
    EXPECT_EQ(names.size(), values.size());
    std::map<std::string, float> result;
    for (std::size_t i = 0; i < std::min(names.size(), values.size()); ++i)
      result[names[i].first] = values[i];
    return result;
  }

  /// Begins `shift` samples later; what was before stands at the end.
  Heart rotated(std::size_t shift) const {
    Heart result = *this;
    for (auto series : {&result.pressure, &result.volume})
      for (std::size_t c = 0; c < compartments.size(); ++c) {
        const auto first = series->begin() + static_cast<std::ptrdiff_t>(c * samples());
        std::rotate(first, first + static_cast<std::ptrdiff_t>(shift),
                    first + static_cast<std::ptrdiff_t>(samples()));
      }
    return result;
  }
};

Heart heart(const Line& pressure = lv_pressure, const Line& volume = lv_volume,
            const Line& aorta = aortic_pressure, double interval_ms = 1) {
  Heart result;
  result.interval_ms = interval_ms;
  const auto samples = static_cast<int>(std::ceil(beat_ms / interval_ms - 1e-9));
  for (const Line& line : {pressure, la_pressure, aorta})
    for (int i = 0; i < samples; ++i) result.pressure.push_back(on_line(line, i * interval_ms));
  for (const Line& line : {volume, Line{{0, 60}, {400, 80}, {800, 60}}, Line{{0, 100}, {800, 100}}})
    for (int i = 0; i < samples; ++i) result.volume.push_back(on_line(line, i * interval_ms));
  return result;
}

// p dV of the lines above: ejection at 80 to 108 mmHg, filling at 10 to 8.
constexpr double ejection_work = (2 * 14 * (80 + 108) / 2.0 + 200 * 108) * 70 / 228;
constexpr double filling_work = (1 * 9 + 400 * 8) * 60.0 / 401 + (100 * 8 + 1 * 9) * 10.0 / 101;
constexpr double stroke_work_mJ = (ejection_work - filling_work) * 0.133322;

void expect_exact(const std::map<std::string, float>& f, const std::string& what) {
  const std::map<std::string, double> exact = {{"lv_edv_mL", 120},
                                               {"lv_esv_mL", 50},
                                               {"lv_sv_mL", 70},
                                               {"lv_ef_percent", 100 * 70 / 120.0},
                                               {"lv_peak_mmHg", 108},
                                               {"lv_edp_mmHg", 10},
                                               {"lv_dpdt_max_mmHg_per_s", 2000},
                                               {"lv_dpdt_min_mmHg_per_s", -2000},
                                               {"lv_isovolumic_contraction_ms", 35},
                                               {"lv_ejection_ms", 228},
                                               {"lv_isovolumic_relaxation_ms", 35},
                                               {"lv_filling_ms", 502},
                                               {"lv_stroke_work_mJ", stroke_work_mJ},
                                               {"la_volume_max_mL", 80},
                                               {"la_volume_min_mL", 60},
                                               {"la_mean_mmHg", 10},
                                               {"aorta_systolic_mmHg", 80},
                                               {"aorta_diastolic_mmHg", 80},
                                               {"aorta_mean_mmHg", 80},
                                               {"cardiac_output_L_per_min", 5.25}};
  for (const auto& [name, value] : exact)
    EXPECT_NEAR(f.at(name), value, 1e-4 * std::max(1.0, std::abs(value))) << name << " " << what;
}

void expect_undefined(const std::map<std::string, float>& f, const std::vector<std::string>& names) {
  for (const std::string& name : names) EXPECT_TRUE(std::isnan(f.at(name))) << name << " " << f.at(name);
}

const std::vector<std::string> lv_phases = {"lv_isovolumic_contraction_ms", "lv_ejection_ms",
                                            "lv_isovolumic_relaxation_ms", "lv_filling_ms"};
const std::vector<std::string> lv_volumes = {"lv_edv_mL", "lv_esv_mL", "lv_sv_mL", "lv_ef_percent",
                                             "cardiac_output_L_per_min"};

TEST(PvFeatures, ALoopOfStraightLinesIsMeasuredExactly) {
  expect_exact(heart().features(), "");
}

TEST(PvFeatures, TheyDoNotDependOnWhereTheBeatBegins) {
  for (std::size_t shift = 1; shift < 800; shift += 7)
    expect_exact(heart().rotated(shift).features(), "from " + std::to_string(shift));
}

TEST(PvFeatures, ABeatNeedNotBeAWholeNumberOfSamples) {
  const Heart coarse = heart(lv_pressure, lv_volume, aortic_pressure, 0.3);
  EXPECT_EQ(coarse.samples(), 2667u);
  const auto f = coarse.features();
  EXPECT_NEAR(f.at("lv_ejection_ms"), 228, 0.05);
  EXPECT_NEAR(f.at("lv_filling_ms"), 502, 0.05);
  EXPECT_NEAR(f.at("lv_edv_mL"), 120, 0.05);
  EXPECT_NEAR(f.at("la_mean_mmHg"), 10, 1e-4);
  EXPECT_NEAR(f.at("cardiac_output_L_per_min"), 5.25, 0.01);
}

TEST(PvFeatures, TheNextFillingIsNotThisBeats) {
  // The next beat begins with 40 mL more.
  Line fuller = lv_volume;
  fuller.back().second = 150;
  const auto f = heart(lv_pressure, fuller).features();
  EXPECT_FLOAT_EQ(f.at("lv_edv_mL"), 120);
  EXPECT_FLOAT_EQ(f.at("lv_esv_mL"), 50);
  EXPECT_NEAR(f.at("lv_ejection_ms"), 228, 1e-3);
  expect_undefined(f, {"lv_stroke_work_mJ"});
}

/// A beat from `start` on of a heart whose every filling adds 40 mL.
Heart filling_heart(int start) {
  Heart result = heart();
  Line fuller = lv_volume;
  fuller.back().second = 150;
  for (int i = 0; i < 800; ++i) {
    const int time = start + i, in_beat = time % 800;
    const auto k = static_cast<std::size_t>(i);
    result.pressure[k] = on_line(lv_pressure, in_beat);
    result.volume[k] = on_line(fuller, in_beat) + (time < 800 ? 0.0f : 40.0f);
  }
  return result;
}

TEST(PvFeatures, OfABeatThatDoesNotCloseOnlyWhatIsWhole) {
  auto f = filling_heart(120).features();  // begins with the mitral valve closed
  EXPECT_FLOAT_EQ(f.at("lv_edv_mL"), 120);
  EXPECT_FLOAT_EQ(f.at("lv_esv_mL"), 50);
  EXPECT_NEAR(f.at("lv_ejection_ms"), 228, 1e-3);
  EXPECT_NEAR(f.at("lv_isovolumic_relaxation_ms"), 35, 1e-3);
  expect_undefined(f, {"lv_isovolumic_contraction_ms", "lv_edp_mmHg", "lv_filling_ms", "lv_stroke_work_mJ"});
  f = filling_heart(250).features();  // begins within an ejection and ends within the next
  expect_undefined(f, lv_phases);
  expect_undefined(f, lv_volumes);
  EXPECT_FLOAT_EQ(f.at("lv_peak_mmHg"), 108);
}

TEST(PvFeatures, OnlyTheLastOfSeveralBeatsCounts) {
  Heart several;
  const Heart last = heart();
  for (auto [to, from] : {std::pair{&several.pressure, &last.pressure}, {&several.volume, &last.volume}})
    for (std::size_t c = 0; c < 3; ++c) {
      const auto begin = from->begin() + static_cast<std::ptrdiff_t>(c * 800);
      for (int i = 0; i < 1000; ++i) to->push_back(300);
      to->insert(to->end(), begin, begin + 800);
    }
  expect_exact(several.features(), "after another");
}

TEST(PvFeatures, AVentricleThatDoesNotEjectHasNoStroke) {
  const auto f = heart(lv_pressure, lv_volume, {{0, 200}, {800, 200}}).features();
  expect_undefined(f, lv_phases);
  expect_undefined(f, lv_volumes);
  expect_undefined(f, {"lv_edp_mmHg"});
  EXPECT_FLOAT_EQ(f.at("lv_peak_mmHg"), 108);
  EXPECT_NEAR(f.at("lv_dpdt_max_mmHg_per_s"), 2000, 0.1);
}

TEST(PvFeatures, AValveThatNeverClosesHasNoPhases) {
  const auto f = heart(lv_pressure, lv_volume, {{0, -10}, {800, -10}}).features();
  expect_undefined(f, lv_phases);
  expect_undefined(f, lv_volumes);
  const auto open = heart({{0, 8}, {800, 8}}).features();  // no contraction at all
  expect_undefined(open, lv_phases);
  EXPECT_FLOAT_EQ(open.at("lv_dpdt_max_mmHg_per_s"), 0);
}

TEST(PvFeatures, BothValvesOpenAtOnceIsNoIsovolumicPhase) {
  Heart leaking = heart();
  std::fill_n(leaking.pressure.begin() + 800, 800, 300.0f);  // the atrium drives through both valves
  expect_undefined(leaking.features(), {"lv_isovolumic_contraction_ms", "lv_isovolumic_relaxation_ms",
                                        "lv_filling_ms", "lv_edp_mmHg"});
}

TEST(PvFeatures, ASeriesShorterThanABeatHasNone) {
  Heart cut = heart();
  cut.beat = 801;
  for (const auto& [name, value] : cut.features()) EXPECT_TRUE(std::isnan(value)) << name;
  Heart none;
  for (const auto& [name, value] : none.features()) EXPECT_TRUE(std::isnan(value)) << name;
}

TEST(PvFeatures, NotANumberReachesWhatNeedsItAlone) {
  Heart spoilt = heart();
  spoilt.pressure[5] = NaN;  // LV
  for (const auto& [name, value] : spoilt.features())
    EXPECT_EQ(std::isnan(value), name.starts_with("lv_") || name.starts_with("cardiac")) << name;
  spoilt = heart();
  spoilt.pressure[800 + 5] = NaN;  // LA
  const auto f = spoilt.features();
  expect_undefined(f, {"la_mean_mmHg", "lv_edp_mmHg", "lv_isovolumic_contraction_ms", "lv_filling_ms"});
  EXPECT_FLOAT_EQ(f.at("lv_edv_mL"), 120);
  spoilt = heart();
  spoilt.volume[2 * 800 + 5] = std::numeric_limits<float>::infinity();  // aorta
  expect_undefined(spoilt.features(), {"aorta_mean_mmHg", "lv_edv_mL", "lv_ejection_ms"});
}

TEST(PvFeatures, AWindkesselFillsFromAConstantPressure) {
  const Heart whole = heart();
  Heart windkessel;
  windkessel.compartments = {"LV", "aorta"};
  for (auto [to, from] :
       {std::pair{&windkessel.pressure, &whole.pressure}, {&windkessel.volume, &whole.volume}}) {
    to->insert(to->end(), from->begin(), from->begin() + 800);
    to->insert(to->end(), from->begin() + 1600, from->end());
  }
  auto f = windkessel.features();
  EXPECT_FLOAT_EQ(f.at("lv_edv_mL"), 120);
  EXPECT_NEAR(f.at("lv_ejection_ms"), 228, 1e-3);
  expect_undefined(f, {"lv_edp_mmHg", "lv_isovolumic_contraction_ms"});
  windkessel.filling_mmHg = 10;
  f = windkessel.features();
  EXPECT_NEAR(f.at("lv_edp_mmHg"), 10, 1e-4);
  EXPECT_NEAR(f.at("lv_isovolumic_contraction_ms"), 35, 1e-3);
  EXPECT_NEAR(f.at("lv_filling_ms"), 502, 1e-3);
}

TEST(PvFeatures, ACavityWithoutACirculationHasItsExtremes) {
  Heart cavity;
  cavity.compartments = {"hollow"};
  cavity.pressure = {0, 5, 2};
  cavity.volume = {3, 2, 1};
  cavity.beat = std::numeric_limits<double>::quiet_NaN();
  const auto f = cavity.features();
  EXPECT_EQ(f.size(), 4u);
  EXPECT_EQ(f.at("hollow_pressure_max_mmHg"), 5);
  EXPECT_EQ(f.at("hollow_volume_min_mL"), 1);
  cavity.pressure = {5};  // an equilibrium
  cavity.volume = {2};
  EXPECT_EQ(cavity.features().at("hollow_pressure_min_mmHg"), 5);
  EXPECT_EQ(cavity.features().at("hollow_volume_max_mL"), 2);
}

/// Lobes (counterclockwise, clockwise) of a curve by its angle, in `samples` steps.
using Lobes = std::pair<int, int>;
Lobes lobes(const std::vector<double>& x, const std::vector<double>& y) {
  const LoopLobes found = loop_lobes(x, y);
  EXPECT_EQ(found.figure_of_eight(), found.counterclockwise == 1 && found.clockwise == 1);
  return {found.counterclockwise, found.clockwise};
}
template <typename Curve>
Lobes lobes(int samples, const Curve& curve, bool backwards = false, int shift = 0) {
  std::vector<double> x, y;
  for (int i = 0; i < samples; ++i) {
    const int k = (backwards ? samples - i : i) + shift;
    const auto [px, py] = curve(2 * M_PI * k / samples);
    x.push_back(px);
    y.push_back(py);
  }
  return lobes(x, y);
}

TEST(LoopLobes, AnEightHasOneOfEitherOrientation) {
  const auto eight = [](double t) { return std::pair(100 + 20 * std::sin(t), 8 + 3 * std::sin(2 * t)); };
  const auto upright = [](double t) { return std::pair(std::sin(2 * t), std::sin(t)); };
  for (const int samples : {7, 8, 40, 41, 800, 8001})
    for (const bool backwards : {false, true})
      for (const int shift : {0, 3}) {
        EXPECT_EQ(lobes(samples, eight, backwards, shift), Lobes(1, 1)) << samples;
        EXPECT_EQ(lobes(samples, upright, backwards, shift), Lobes(1, 1)) << samples;
      }
}

TEST(LoopLobes, ALobeOfLessThanAHundredthIsNone) {
  const auto eight = [](double share) {
    return [share](double t) {
      const double size = std::sin(t) > 0 ? 1 : share;
      return std::pair(size * std::sin(t), size * std::sin(2 * t) / 2);
    };
  };
  EXPECT_EQ(lobes(800, eight(0.11)), Lobes(1, 1));
  // What is left, at the right, runs clockwise.
  EXPECT_EQ(lobes(800, eight(0.09)), Lobes(0, 1));
  EXPECT_EQ(lobes(800, eight(0.09), true), Lobes(1, 0));
}

TEST(LoopLobes, ARingIsOneWithAnInnerLoopToo) {
  EXPECT_EQ(lobes(500, [](double t) { return std::pair(std::cos(t), std::sin(t)); }), Lobes(1, 0));
  EXPECT_EQ(lobes(500, [](double t) { return std::pair(std::sin(t), std::cos(t)); }), Lobes(0, 1));
  EXPECT_EQ(lobes(500,
                  [](double t) {
                    const double r = 0.5 + std::cos(t);
                    return std::pair(r * std::cos(t), r * std::sin(t));
                  }),
            Lobes(1, 0));
}

TEST(LoopLobes, ThreeInARow) {
  const auto chain = [](double t) { return std::pair(std::sin(t), std::cos(3 * t)); };
  const Lobes found = lobes(600, chain);
  EXPECT_EQ(found.first + found.second, 3);
  EXPECT_NE(found.first, found.second);
}

/// Two squares joined by a stalk that is passed to and fro, with noise as of rounding; of one orientation, or
/// of two. The stalk is oblique, as the passive line of an atrium.
Lobes dumbbell(bool opposite, int steps, double noise) {
  const std::vector<std::pair<double, double>> left = {{-1, -1}, {-1, -2}, {-2, -2}, {-2, -1}};
  std::vector<std::pair<double, double>> corners = left;  // clockwise
  for (const auto& [px, py] : left) corners.emplace_back(-px, -py);
  if (opposite) std::reverse(corners.begin() + 5, corners.end());
  corners.insert(corners.begin() + 4, left.front());
  corners.push_back(corners[5]);
  std::vector<double> x, y;
  unsigned random = 1;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto [x0, y0] = corners[i];
    const auto [x1, y1] = corners[(i + 1) % corners.size()];
    for (int k = 0; k < steps; ++k) {
      const auto rounding = [&] {
        random = random * 1664525u + 1013904223u;
        return noise * (random / 4294967296.0 - 0.5);
      };
      x.push_back(x0 + (x1 - x0) * k / steps + rounding());
      y.push_back(y0 + (y1 - y0) * k / steps + rounding());
    }
  }
  return lobes(x, y);
}

TEST(LoopLobes, StrandsThatLieTogetherAreNone) {
  for (const int steps : {1, 2, 7, 40, 200})
    for (const double noise : {0.0, 1e-7, 1e-6}) {
      EXPECT_EQ(dumbbell(true, steps, noise), Lobes(1, 1)) << steps << " " << noise;
      EXPECT_EQ(dumbbell(false, steps, noise), Lobes(0, 2)) << steps << " " << noise;
    }
}

TEST(LoopLobes, ATouchIsNoCrossing) {
  // A crescent: round a circle, then backwards round a smaller one that touches it from within.
  const auto crescent = [](double t) {
    return t < M_PI ? std::pair(std::cos(2 * t), std::sin(2 * t))
                    : std::pair(0.5 + 0.5 * std::cos(2 * t), -0.5 * std::sin(2 * t));
  };
  for (const int samples : {40, 42, 800}) EXPECT_EQ(lobes(samples, crescent), Lobes(1, 0)) << samples;
}

TEST(LoopLobes, ALineAndAPointHaveNone) {
  EXPECT_EQ(lobes(600, [](double t) { return std::pair(std::sin(t), std::sin(3 * t)); }), Lobes(0, 0));
  EXPECT_EQ(lobes(100, [](double t) { return std::pair(std::cos(t), 2 * std::cos(t)); }), Lobes(0, 0));
  EXPECT_EQ(lobes(100, [](double) { return std::pair(1.0, 2.0); }), Lobes(0, 0));
  EXPECT_EQ(lobes(100, [](double t) { return std::pair(std::cos(t), 1.0); }), Lobes(0, 0));
}

TEST(PvFeatures, AnAtriumTellsItsLoop) {
  Heart h;
  h.compartments = {"LA"};
  for (int i = 0; i < 800; ++i) {
    const double t = 2 * M_PI * i / 800;
    h.volume.push_back(static_cast<float>(60 + 20 * std::sin(t)));
    h.pressure.push_back(static_cast<float>(8 + 3 * std::sin(2 * t)));
  }
  auto f = h.features();
  EXPECT_EQ(f.at("la_figure_of_eight"), 1);
  EXPECT_EQ(f.at("la_lobes_clockwise"), 1);
  EXPECT_EQ(f.at("la_lobes_counterclockwise"), 1);
  EXPECT_NEAR(f.at("la_mean_mmHg"), 8, 1e-5);
  for (int i = 0; i < 800; ++i) h.volume[static_cast<std::size_t>(i)] += static_cast<float>(0.01 * i);
  expect_undefined(h.features(), {"la_figure_of_eight", "la_lobes_clockwise"});  // does not close
}

}  // namespace
}  // namespace cohort
