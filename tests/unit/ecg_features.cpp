// The measurements of an ECG, on series whose onsets and ends are known.
#include "solver/ecg_features.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>

namespace cohort::test {
namespace {

using Leads = std::array<std::vector<double>, 8>;  // I, II, V1 ... V6

// Twelve leads from the independent eight.
std::vector<float> twelve(const Leads& leads) {
  const size_t samples = leads[0].size();
  std::vector<float> ecg(12 * samples);
  for (size_t k = 0; k < samples; ++k) {
    const double I = leads[0][k], II = leads[1][k];
    const double row[] = {I, II, II - I, -0.5 * (I + II), I - 0.5 * II, II - 0.5 * I};
    for (size_t l = 0; l < 6; ++l) ecg[l * samples + k] = static_cast<float>(row[l]);
    for (size_t v = 0; v < 6; ++v) ecg[(6 + v) * samples + k] = static_cast<float>(leads[2 + v][k]);
  }
  return ecg;
}

// A beat of corners: QRS is a triangle wave, so that its velocity is constant and its ends are sharp; P a
// raised cosine; T rises as a cosine and falls along a line, its own tangent.
struct Beat {
  double P_onset = 50, P_offset = 150, QRS_onset = 200, QRS_peak = 240, QRS_offset = 290, T_onset = 340,
         T_peak = 430, T_end = 520;
  double P_mV = 0.15, T_mV = 0.3;
  double interval_ms = 1;
  std::array<double, 8> R = {0.8, 1.0, -1.0, -0.8, -0.2, 0.6, 1.0, 0.9};  // of QRS

  Leads leads(double length_ms = 700) const {
    Leads result;
    for (size_t l = 0; l < 8; ++l)
      for (double t = 0; t < length_ms; t += interval_ms) {
        const auto ramp = [&](double from, double peak, double to) {
          if (t <= from || t >= to) return 0.0;
          return t < peak ? (t - from) / (peak - from) : (to - t) / (to - peak);
        };
        const auto cosine = [&](double from, double to) {
          if (t <= from || t >= to) return 0.0;
          return 0.5 * (1 - std::cos(2 * std::numbers::pi * (t - from) / (to - from)));
        };
        double x = R[l] * ramp(QRS_onset, QRS_peak, QRS_offset) +
                   T_mV * (t < T_peak ? cosine(T_onset, 2 * T_peak - T_onset) : ramp(T_onset, T_peak, T_end));
        x += P_mV * cosine(P_onset, P_offset);
        result[l].push_back(x);
      }
    return result;
  }
};

std::map<std::string, double> measure(const Leads& leads, double interval_ms = 1) {
  const std::vector<float> values = ecg_features(twelve(leads), interval_ms);
  const auto names = ecg_feature_names();
  EXPECT_EQ(values.size(), names.size());
  std::map<std::string, double> result;
  for (size_t k = 0; k < names.size(); ++k) result[names[k].first] = static_cast<double>(values[k]);
  return result;
}

TEST(EcgFeatures, FindTheOnsetsOfACleanBeat) {
  for (const double interval : {1.0, 2.0, 0.5}) {
    Beat beat;
    beat.interval_ms = interval;
    auto f = measure(beat.leads(), interval);
    const double sharp = 1.1 * interval;  // central differences see a corner one sample early
    EXPECT_NEAR(f["ecg_QRS_onset_ms"], 200, sharp);
    EXPECT_NEAR(f["ecg_QRS_offset_ms"], 290, sharp);
    EXPECT_NEAR(f["ecg_QRS_ms"], 90, 2 * sharp);
    EXPECT_NEAR(f["ecg_T_end_ms"], 520, 2 * sharp);
    EXPECT_NEAR(f["ecg_QT_ms"], 320, 2 * sharp);
    EXPECT_NEAR(f["ecg_P_onset_ms"], 50, 4);  // a cosine starts flat
    EXPECT_NEAR(f["ecg_P_offset_ms"], 150, 4);
    EXPECT_NEAR(f["ecg_PR_ms"], 150, 5);
  }
}

TEST(EcgFeatures, AmplitudesAndAxes) {
  Beat beat;
  auto f = measure(beat.leads());
  const double I = 0.8, aVF = 1.0 - 0.4;
  EXPECT_NEAR(f["ecg_QRS_axis_deg"], std::atan2(2 / std::sqrt(3.0) * aVF, I) * 180 / std::numbers::pi, 0.5);
  EXPECT_NEAR(f["ecg_T_axis_deg"], 30, 0.5);  // I and II alike
  EXPECT_NEAR(f["ecg_R_V5_mV"], 1.0, 0.01);
  EXPECT_NEAR(f["ecg_S_V5_mV"], 0.0, 0.01);
  EXPECT_NEAR(f["ecg_S_V1_mV"], -1.0, 0.01);
  EXPECT_NEAR(f["ecg_R_V1_mV"], 0.0, 0.01);
  EXPECT_NEAR(f["ecg_R_peak_V5_ms"], 40, 2);
  EXPECT_NEAR(f["ecg_T_V2_mV"], 0.3, 0.01);
  EXPECT_NEAR(f["ecg_T_aVR_mV"], -0.3, 0.01);
}

// A dipole along each lead of Einthoven's triangle has that lead's direction as its axis.
TEST(EcgFeatures, AxesOfEinthovensTriangle) {
  for (const double angle : {0.0, 60.0, 120.0, -30.0, 90.0, -150.0}) {
    Beat beat;
    const double radians = angle * std::numbers::pi / 180;
    beat.R[0] = std::cos(radians);
    beat.R[1] = std::cos(radians - std::numbers::pi / 3);
    EXPECT_NEAR(measure(beat.leads())["ecg_QRS_axis_deg"], angle, 0.5);
  }
}

TEST(EcgFeatures, OnsetsMoveLittleWithNoise) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.01);  // 10 uV, a good clinical recorder
  const Beat beat;
  double worst_qrs = 0, worst_t = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Leads leads = beat.leads();
    for (auto& lead : leads)
      for (double& x : lead) x += noise(random);
    auto f = measure(leads);
    worst_qrs =
        std::max({worst_qrs, std::abs(f["ecg_QRS_onset_ms"] - 200), std::abs(f["ecg_QRS_offset_ms"] - 290)});
    worst_t = std::max(worst_t, std::abs(f["ecg_T_end_ms"] - 520));
    EXPECT_FALSE(std::isnan(worst_qrs) || std::isnan(worst_t)) << trial;
  }
  std::printf("10 uV of noise: QRS within %.1f ms, end of T within %.1f ms\n", worst_qrs, worst_t);
  EXPECT_LT(worst_qrs, 8);  // 2.5 ms of smoothing widens a sharp corner by up to two deviations
  EXPECT_LT(worst_t, 12);
}

// Wherever a series ends, what is told of the beat is that of the whole beat or nothing.
TEST(EcgFeatures, WavesCutByTheEndAreNaN) {
  const auto whole = measure(Beat{}.leads());
  for (double length = 210; length <= 600; length += 5) {
    const auto cut = measure(Beat{}.leads(length));
    const auto expect_told_from = [&](const std::string& name, double from_ms, double tolerance) {
      const double value = cut.at("ecg_" + name);
      if (length < from_ms)
        EXPECT_TRUE(std::isnan(value)) << name << " is " << value << " of " << length << " ms";
      else
        EXPECT_NEAR(value, whole.at("ecg_" + name), tolerance) << name << " of " << length << " ms";
    };
    constexpr double quiet = 10;  // behind QRS, until it counts as over
    for (const char* name : {"P_ms", "PR_ms", "QRS_onset_ms"}) expect_told_from(name, 0, 1e-3);
    for (const char* name : {"QRS_ms", "QRS_offset_ms", "QRS_axis_deg", "R_V6_mV", "S_V1_mV", "R_peak_V6_ms"})
      expect_told_from(name, 290 + quiet, 1e-3);
    for (const char* name : {"QT_ms", "T_end_ms", "T_II_mV", "T_V6_mV", "T_axis_deg"})
      expect_told_from(name, 520, 0.5);
  }
}

// The end of T is the median over the leads, of which some end behind the series.
TEST(EcgFeatures, LeadsWhoseTIsCutCountAsLater) {
  const auto with_late_leads = [](size_t late, double length) {
    Leads leads = Beat{}.leads(length);
    Beat slow;
    slow.T_end = 640;
    const Leads other = slow.leads(length);
    for (size_t l = 0; l < late; ++l) leads[l] = other[l];
    return measure(leads).at("ecg_T_end_ms");
  };
  EXPECT_NEAR(with_late_leads(3, 700), 520, 2);
  EXPECT_NEAR(with_late_leads(3, 600), 520, 2);
  EXPECT_NEAR(with_late_leads(5, 700), 640, 2);
  EXPECT_TRUE(std::isnan(with_late_leads(5, 600))) << with_late_leads(5, 600);
}

TEST(EcgFeatures, WhatIsNotThereIsNaN) {
  Beat beat;
  beat.P_mV = 0;
  auto no_P = measure(beat.leads());
  EXPECT_TRUE(std::isnan(no_P["ecg_P_ms"]));
  EXPECT_TRUE(std::isnan(no_P["ecg_PR_ms"]));
  EXPECT_NEAR(no_P["ecg_QRS_ms"], 90, 3);
  EXPECT_NEAR(no_P["ecg_QT_ms"], 320, 3);

  beat.P_mV = 0.15;
  beat.T_mV = 0;
  auto no_T = measure(beat.leads());
  EXPECT_TRUE(std::isnan(no_T["ecg_QT_ms"]));
  EXPECT_TRUE(std::isnan(no_T["ecg_T_II_mV"]));
  EXPECT_NEAR(no_T["ecg_PR_ms"], 150, 5);

  auto cut = measure(Beat{}.leads(500));  // ends before T does
  EXPECT_TRUE(std::isnan(cut["ecg_QT_ms"])) << cut["ecg_QT_ms"];
  EXPECT_NEAR(cut["ecg_QRS_ms"], 90, 3);

  Leads flat;
  for (auto& lead : flat) lead.assign(500, 0.1);
  for (const auto& [name, value] : measure(flat)) EXPECT_TRUE(std::isnan(value)) << name;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.01);
  for (auto& lead : flat)
    for (double& x : lead) x = noise(random);
  EXPECT_TRUE(std::isnan(measure(flat)["ecg_QRS_ms"]));
  flat[3][20] = std::nan("");
  for (const auto& [name, value] : measure(flat)) EXPECT_TRUE(std::isnan(value)) << name;
  EXPECT_EQ(ecg_features({}, 1).size(), ecg_feature_names().size());
}

}  // namespace
}  // namespace cohort::test
