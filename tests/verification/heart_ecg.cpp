// The heart of configs/ecg.yaml: its 12-lead ECG against what is normal in healthy adults, and its bundle
// branch blocks against their textbook criteria (tests/reference/physiology_ecg.yaml).
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

const YAML::Node& reference() {
  static const YAML::Node node = YAML::LoadFile(COHORT_SOURCE_DIR "/tests/reference/physiology_ecg.yaml");
  return node;
}

struct Heart {
  std::map<std::string, double> feature;
  std::vector<float> ecg;
  std::vector<std::string> leads;
  double interval_ms = 1;

  // QRS of a lead against its start, mV.
  std::vector<double> qrs(const std::string& lead) const {
    const std::size_t samples = ecg.size() / 12;
    const auto l = static_cast<std::size_t>(std::find(leads.begin(), leads.end(), lead) - leads.begin());
    const auto first = static_cast<std::size_t>(feature.at("ecg_QRS_onset_ms") / interval_ms);
    const auto last = static_cast<std::size_t>(std::ceil(feature.at("ecg_QRS_offset_ms") / interval_ms));
    std::vector<double> x;
    for (std::size_t k = first; k <= last; ++k)
      x.push_back(static_cast<double>(ecg[l * samples + k]) - static_cast<double>(ecg[l * samples + first]));
    return x;
  }
  double R(const std::string& lead) const {
    const auto x = qrs(lead);
    return *std::max_element(x.begin(), x.end());
  }
  double S(const std::string& lead) const {
    const auto x = qrs(lead);
    return -*std::min_element(x.begin(), x.end());
  }
  double area(const std::string& lead) const {
    double sum = 0;
    for (const double x : qrs(lead)) sum += x * interval_ms;
    return sum;
  }
  // Time spent below zero behind the largest R, ms.
  double S_duration_ms(const std::string& lead) const {
    const auto x = qrs(lead);
    const auto peak = std::max_element(x.begin(), x.end());
    return interval_ms *
           static_cast<double>(std::count_if(peak, x.end(), [](double v) { return v < -0.02; }));
  }
};

Heart simulate(std::vector<std::string> changes) {
  const Campaign campaign = read_campaign(COHORT_SOURCE_DIR "/configs/ecg.yaml", changes);
  Member member{0, campaign.scene.parameters.values()};
  campaign.scene.parameters.resolve(member.values);
  const Plan plan = make_plan(device(), campaign.scene, {&member, 1}, {});
  Simulation simulation(device(), campaign.scene, plan);
  const Recording recording = simulation.run({&member, 1}, 600)[0];
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  const Layout shape = layout(campaign.scene);
  Heart heart{{}, recording.ecg, shape.leads, shape.ecg_ms[1] - shape.ecg_ms[0]};
  for (size_t k = 0; k < shape.features.size(); ++k)
    heart.feature[shape.features[k]] = static_cast<double>(recording.features[k]);
  return heart;
}

void print(const char* what, const Heart& heart) {
  std::printf("%-14s", what);
  for (const char* name : {"P_ms", "PR_ms", "QRS_ms", "QT_ms", "QRS_axis_deg", "T_axis_deg"})
    std::printf(" %s %.0f", name, heart.feature.at("ecg_" + std::string(name)));
  std::printf("\n%14s R/S", "");
  for (const char* lead : {"V1", "V2", "V3", "V4", "V5", "V6"})
    std::printf("  %s %.2f/%.2f", lead, heart.R(lead), heart.S(lead));
  std::printf(
      " mV\n%14s activation of the ventricles %.0f ms, of the atria %.0f ms\n", "",
      std::max(heart.feature.at("activation_last_lv_ms"), heart.feature.at("activation_last_rv_ms")) -
          std::min(heart.feature.at("activation_first_lv_ms"), heart.feature.at("activation_first_rv_ms")),
      std::max(heart.feature.at("activation_last_la_ms"), heart.feature.at("activation_last_ra_ms")) -
          heart.feature.at("activation_first_ra_ms"));
}

void expect_normal(const Heart& heart) {
  const auto within = [&](double value, const YAML::Node& range, const std::string& what) {
    EXPECT_GE(value, range[0].as<double>()) << what;
    EXPECT_LE(value, range[1].as<double>()) << what;
  };
  for (const auto& interval : reference()["intervals_ms"]) {
    const auto name = interval.first.as<std::string>();
    within(heart.feature.at("ecg_" + name + "_ms"), interval.second, name);
  }
  within(heart.feature.at("ecg_QRS_axis_deg"), reference()["axis_deg"], "axis");

  EXPECT_LT(heart.R("V1"), heart.S("V1"));
  EXPECT_GT(heart.R("V5"), heart.S("V5"));
  EXPECT_GT(heart.R("V6"), heart.S("V6"));
  std::string transition;  // the first lead whose R is no smaller than its S
  for (const char* lead : {"V1", "V2", "V3", "V4", "V5", "V6"})
    if (transition.empty() && heart.R(lead) >= heart.S(lead)) transition = lead;
  const auto zone = reference()["transition_leads"].as<std::vector<std::string>>();
  EXPECT_TRUE(std::find(zone.begin(), zone.end(), transition) != zone.end()) << transition;

  for (const auto& lead : reference()["concordant_T"]) {
    const auto name = lead.as<std::string>();
    const double T = heart.feature.at("ecg_T_" + name + "_mV");
    EXPECT_GT(T * heart.area(name), 0) << name;
    EXPECT_GT(T, 0) << name;
  }
}

TEST(HeartEcg, IsNormalAt2mm) {
  const Heart heart = simulate({"grid.dx_mm=2"});
  print("normal, 2 mm", heart);
  expect_normal(heart);
}

TEST(HeartEcg, IsNormalAt1mm) {
  const Heart heart = simulate({"grid.dx_mm=1"});
  print("normal, 1 mm", heart);
  expect_normal(heart);
}

// What templates leave out, diffusion in front and repolarisation, changes no diagnosis: the same heart by
// reaction_eikonal is normal too, and what is measured on its ECG differs by little.
TEST(HeartEcg, IsNormalByReactionEikonalAndClose) {
  const Heart templates = simulate({"grid.dx_mm=2"});
  const Heart loop = simulate({"grid.dx_mm=2", "scene.electrophysiology.activation=reaction_eikonal"});
  print("templates", templates);
  print("time loop", loop);
  expect_normal(loop);
  for (const char* name : {"P", "PR", "QRS", "QT"}) {
    const std::string feature = "ecg_" + std::string(name) + "_ms";
    std::printf("  %s %+.2f ms", name, templates.feature.at(feature) - loop.feature.at(feature));
    EXPECT_NEAR(templates.feature.at(feature), loop.feature.at(feature), 2) << name;
  }
  for (const char* name : {"P", "QRS", "T"}) {
    const std::string feature = "ecg_" + std::string(name) + "_axis_deg";
    const double turn = std::remainder(templates.feature.at(feature) - loop.feature.at(feature), 360);
    std::printf("  %s axis %+.2f deg", name, turn);
    EXPECT_LT(std::abs(turn), std::string(name) == "QRS" ? 12 : 3) << name;
  }
  double difference = 0, size = 0;
  ASSERT_EQ(templates.ecg.size(), loop.ecg.size());
  for (std::size_t k = 0; k < loop.ecg.size(); ++k) {
    difference += std::pow(static_cast<double>(templates.ecg[k] - loop.ecg[k]), 2);
    size += std::pow(static_cast<double>(loop.ecg[k]), 2);
  }
  std::printf("  ECG %.1f %% RMS\n", 100 * std::sqrt(difference / size));
  EXPECT_LT(std::sqrt(difference / size), 0.12);  // measured 0.101: what templates leave out at 2 mm
}

const std::string sites = "electrophysiology.conduction_system.early_sites.";

TEST(HeartEcg, WithoutTheLeftSitesIsALeftBundleBranchBlock) {
  const Heart heart = simulate({sites + "lv_septum=off", sites + "lv_anterior=off", sites + "lv_inferior=off",
                                sites + "lv_lateral=off"});
  print("left block", heart);
  EXPECT_GE(heart.feature.at("ecg_QRS_ms"), reference()["block_QRS_ms"].as<double>());
  for (const char* lead : {"I", "aVL", "V6"}) EXPECT_GT(heart.area(lead), 0) << lead;
  EXPECT_LT(heart.S("V6"), 0.1 * heart.R("V6"));  // R alone, no q
  for (const char* lead : {"I", "V6"}) {          // no q: QRS begins upwards
    const auto x = heart.qrs(lead);
    const auto peak = std::max_element(x.begin(), x.end());
    EXPECT_GT(*std::min_element(x.begin(), peak + 1), -0.05) << lead;
  }
  EXPECT_GT(heart.feature.at("ecg_R_peak_V6_ms"), reference()["left"]["R_peak_V6_ms"].as<double>());
  EXPECT_LT(heart.R("V1"), 0.2 * heart.S("V1"));  // rS or QS
}

TEST(HeartEcg, WithoutTheRightSitesIsARightBundleBranchBlock) {
  const Heart heart = simulate({sites + "rv_septum=off", sites + "rv_free_wall=off"});
  print("right block", heart);
  EXPECT_GE(heart.feature.at("ecg_QRS_ms"), reference()["block_QRS_ms"].as<double>());
  // r S R' in V1, R' the larger.
  const auto x = heart.qrs("V1");
  const auto s = std::min_element(x.begin(), x.end());
  EXPECT_LT(*s, 0);
  const double r = *std::max_element(x.begin(), s), r_prime = *std::max_element(s, x.end());
  EXPECT_GT(r, 0);
  EXPECT_GT(r_prime, r);
  EXPECT_GT(heart.area("V1"), 0);
  for (const char* lead : {"I", "V6"})
    EXPECT_GE(heart.S_duration_ms(lead), reference()["right"]["S_duration_ms"].as<double>()) << lead;
}

}  // namespace
}  // namespace cohort::test
