#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "ensemble/stability_design.hpp"
#include "ensemble/stability_outcomes.hpp"
#include "ensemble/table.hpp"

namespace cohort {
namespace {

constexpr float NaN = std::numeric_limits<float>::quiet_NaN();

// Right and left chambers of elastance: nothing but a circulation.
const char* const circulation = R"(
scene:
  geometry: none
  circulation: {}
  time: {beats: {at_most: 2}}
outputs: {pv: {rate_hz: 100}}
)";
const char* const afterload = "circulation.systemic.arterial_resistance_mmHg_s_per_mL";
const char* const compliance = "circulation.systemic.arterial_compliance_mL_per_mmHg";
const char* const valves = "circulation.valves.open_resistance_mmHg_s_per_mL";
const char* const mitral = "circulation.valves.mitral.open_resistance_mmHg_s_per_mL";
const char* const aortic = "circulation.valves.aortic.open_resistance_mmHg_s_per_mL";

StabilityCase example(std::int64_t corners, std::int64_t interior, std::int64_t with_inside) {
  StabilityCase one;
  one.campaign = parse_campaign(circulation, "base.yaml");
  one.ranges = {{afterload, 0.4, 1.2}, {compliance, 0.8, 2}, {valves, 0.005, 0.02}};
  one.extremes = {{"closed", {{mitral, 5}, {afterload, 10}}}, {"within", {{afterload, 0.9}}}};
  one.corners = corners;
  one.interior = interior;
  one.with_inside = with_inside;
  return one;
}

std::vector<double> row(const StabilityDesign& design, std::size_t member) {
  const auto first = design.values.begin() + static_cast<std::ptrdiff_t>(member * design.paths.size());
  return {first, first + static_cast<std::ptrdiff_t>(design.paths.size())};
}

TEST(StabilityDesign, HasEveryGroup) {
  const StabilityDesign design = stability_design(example(20, 5, 2), 3);
  EXPECT_EQ(design.paths, (std::vector<std::string>{afterload, compliance, valves, mitral}));
  std::vector<std::string> groups = {"defaults"};
  groups.insert(groups.end(), 8, "corners");  // no more than 2^3
  groups.insert(groups.end(), 5, "interior");
  groups.insert(groups.end(), 3, "closed");
  groups.insert(groups.end(), 3, "within");
  EXPECT_EQ(design.groups, groups);
  const std::vector<std::uint8_t> inside = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 1, 1, 1};
  EXPECT_EQ(design.inside, inside);
}

TEST(StabilityDesign, CornersAreEndsOfAllRangesAndNoneTwice) {
  const StabilityCase one = example(8, 0, 0);
  const StabilityDesign design = stability_design(one, 3);
  std::set<std::vector<double>> distinct;
  for (std::size_t i = 1; i <= 8; ++i) {
    const std::vector<double> values = row(design, i);
    distinct.insert(values);
    for (std::size_t p = 0; p < 3; ++p)
      EXPECT_TRUE(values[p] == one.ranges[p].low || values[p] == one.ranges[p].high);
    EXPECT_EQ(values[3], values[2]);  // a valve follows what all valves have
  }
  EXPECT_EQ(distinct.size(), 8u);
}

// 2^40 corners: a choice, in pairs of opposites, so that each end of each range is met equally often.
TEST(StabilityDesign, ManyRangesGetPairsOfOppositeCorners) {
  StabilityCase one;
  one.campaign = parse_campaign(circulation, "base.yaml");
  for (const Parameter& parameter : one.campaign.scene.parameters.all())
    if (!parameter.structural && one.ranges.size() < 40)
      one.ranges.push_back({parameter.path, parameter.lower, parameter.upper});
  ASSERT_EQ(one.ranges.size(), 40u);
  one.corners = 200;
  const StabilityDesign design = stability_design(one, 1);
  std::set<std::vector<double>> distinct;
  for (std::size_t i = 1; i <= 200; ++i) distinct.insert(row(design, i));
  EXPECT_EQ(distinct.size(), 200u);
  for (std::size_t p = 0; p < 40; ++p) {
    int high = 0;
    for (std::size_t i = 1; i <= 200; ++i) high += row(design, i)[p] == one.ranges[p].high;
    EXPECT_EQ(high, 100) << p;
  }
}

TEST(StabilityDesign, IsAFunctionOfTheSeed) {
  const StabilityCase one = example(4, 6, 1);
  EXPECT_EQ(stability_design(one, 3).values, stability_design(one, 3).values);
  EXPECT_NE(stability_design(one, 3).values, stability_design(one, 4).values);
}

TEST(StabilityDesign, PointsBetweenLieStrictlyInside) {
  const StabilityCase one = example(0, 64, 0);
  const StabilityDesign design = stability_design(one, 3);
  for (std::size_t i = 1; i <= 64; ++i)
    for (std::size_t p = 0; p < 3; ++p) {
      EXPECT_GT(row(design, i)[p], one.ranges[p].low);
      EXPECT_LT(row(design, i)[p], one.ranges[p].high);
    }
}

TEST(StabilityDesign, ASceneBeyondWhatIsPromisedHasNoMemberInside) {
  StabilityCase one = example(4, 4, 0);
  one.inside = false;
  const StabilityDesign design = stability_design(one, 3);
  EXPECT_EQ(std::count(design.inside.begin(), design.inside.end(), 1), 0);
}

TEST(StabilityDesign, MembersHaveItsValuesAndWhatInheritsFollows) {
  StabilityCase one = example(8, 2, 1);
  const StabilityDesign design = stability_design(one, 3);
  use_design(design, 3, one.campaign);
  const std::vector<Member> all = members(one.campaign);
  ASSERT_EQ(all.size(), design.groups.size());
  const ParameterTable& table = one.campaign.scene.parameters;
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t p = 0; p < design.paths.size(); ++p)
      EXPECT_EQ(all[i].values[static_cast<std::size_t>(table.index(design.paths[p]))], row(design, i)[p]);
    // The aortic valve is named nowhere: it follows that of all valves.
    EXPECT_EQ(all[i].values[static_cast<std::size_t>(table.index(aortic))], row(design, i)[2]);
  }
}

TEST(StabilityDesign, AnotherDesignIsAnotherCampaign) {
  StabilityCase a = example(8, 2, 1), b = example(8, 2, 1), c = example(8, 2, 1);
  c.inside = false;
  use_design(stability_design(a, 3), 3, a.campaign);
  use_design(stability_design(b, 4), 4, b.campaign);
  use_design(stability_design(c, 3), 3, c.campaign);
  EXPECT_NE(a.campaign.sha256, b.campaign.sha256);
  EXPECT_NE(a.campaign.sha256, c.campaign.sha256);
}

Layout heart_layout() {
  Layout layout;
  layout.leads = {"I", "II", "III", "aVR", "aVL", "aVF", "V1", "V2", "V3", "V4", "V5", "V6"};
  layout.ecg_ms = {0, 1};
  layout.compartments = {"LV", "aorta"};
  layout.pv_ms = {0, 1, 2};
  layout.features = {"qrs_ms",         "blood_apart_mL",      "smallest_volume_ratio",
                     "active_work_mJ", "lv_work_on_blood_mJ", "energy_residual"};
  return layout;
}

StoredRow sound_row() {
  StoredRow row;
  for (const double lead : {1.0, 3.0, 2.0, -2.0, -0.5, 2.5, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6})
    row.ecg.insert(row.ecg.end(), {static_cast<float>(lead), static_cast<float>(2 * lead)});
  row.pressure = {8, 100, 110, 80, 79, 100};
  row.volume = {120, 119, 80, 60, -2, 61};  // the stressed volume of an artery may be negative
  row.features = {NaN, 1e-3f, 0.8f, 1000, 990, -0.002f};
  row.dt_ms = 0.2;
  return row;
}

std::string check(const std::function<void(StoredRow&)>& spoil) {
  StoredRow row = sound_row();
  spoil(row);
  return failed_check(heart_layout(), row);
}

TEST(StabilityChecks, ASoundRowPasses) {
  EXPECT_EQ(failed_check(heart_layout(), sound_row()), "");
}

TEST(StabilityChecks, EachFindsWhatIsWrong) {
  EXPECT_EQ(check([](StoredRow& r) { r.ecg[7] = NaN; }), "lead of aVR is nan at sample 1");
  EXPECT_EQ(check([](StoredRow& r) { r.pressure[4] = INFINITY; }), "pressure of aorta is inf at sample 1");
  EXPECT_EQ(check([](StoredRow& r) { r.volume[2] = NaN; }), "volume of LV is nan at sample 2");
  EXPECT_EQ(check([](StoredRow& r) { r.volume[2] = -1; }), "the volume of LV falls to -1 mL");
  EXPECT_EQ(check([](StoredRow& r) { r.features[0] = INFINITY; }), "qrs_ms is infinite");
  EXPECT_EQ(check([](StoredRow& r) { r.ecg[4] = 2.1f; }), "the limb leads do not add up at sample 0");
  EXPECT_EQ(check([](StoredRow& r) { r.features[1] = 0.02f; }),
            "blood and cavity are 0.02 mL apart, of 120 mL");
  EXPECT_EQ(check([](StoredRow& r) { r.features[1] = NaN; }), "blood and cavity are nan mL apart, of 120 mL");
  EXPECT_EQ(check([](StoredRow& r) { r.features[2] = 0; }), "a cell was pressed to 0 of its volume");
  EXPECT_EQ(check([](StoredRow& r) { r.features[2] = NaN; }), "a cell was pressed to nan of its volume");
  EXPECT_EQ(check([](StoredRow& r) { r.features[5] = -0.06f; }),
            "-0.06 of the energy of the tissue is left over");
  EXPECT_EQ(check([](StoredRow& r) { r.features[4] = NaN; }), "nan of the energy of the tissue is left over");
  EXPECT_EQ(check([](StoredRow& r) { r.features[5] = NaN; }), "nan of the energy of the tissue is left over");
  EXPECT_EQ(check([](StoredRow& r) { r.dt_ms = std::nan(""); }), "the step is nan ms");
}

// Where muscle does little and the blood pushes, what is left over is measured by the blood's work.
TEST(StabilityChecks, EnergyIsWeighedByTheLargestTerm) {
  EXPECT_EQ(check([](StoredRow& r) {
              r.features[3] = 10;
              r.features[5] = 0.4f;
            }),
            "");
  EXPECT_EQ(check([](StoredRow& r) {
              r.features[3] = 0;
              r.features[5] = 0.06f;
            }),
            "0.06 of the energy of the tissue is left over");
}

TEST(StabilityOutcomes, ReasonsOfOneCauseAreOneText) {
  EXPECT_EQ(masked("the step of 0.507 ms is beyond 2.67e-01 ms at (60, -0.5, +24) mm, at 1e3 ms."),
            "the step of # ms is beyond # ms at (#, #, #) mm, at # ms.");
  EXPECT_EQ(masked("region \"V1_4\" of lv2 holds no cell"), "region \"V1_4\" of lv2 holds no cell");
  EXPECT_EQ(masked("3 cells"), "# cells");
}

std::vector<StabilityResult> results() {
  const auto ended = [](Status status, const std::string& cause, const std::string& reason, double at_ms) {
    return StabilityOutcome{status, cause, reason, at_ms};
  };
  const auto nan = std::nan("");
  return {{"heart",
           {{"defaults", "corners", "corners", "corners", "wild"}, {1, 1, 1, 1, 0}},
           {ended(Status::done, "done", "", nan), ended(Status::done, "done", "", nan),
            ended(Status::unstable, "unstable: ran away at # ms", "ran away at 3 ms", 3),
            ended(Status::done, "done", "", nan),
            ended(Status::unstable, "unstable: ran away at # ms", "ran away at 4 ms", 4)}}};
}

TEST(StabilityOutcomes, TheVerdictWeighsMembersInside) {
  const StabilityVerdict found = verdict(results());
  EXPECT_EQ(found.members, 5);
  EXPECT_EQ(found.done, 3);
  EXPECT_EQ(found.inside, 4);
  EXPECT_EQ(found.inside_done, 3);
  EXPECT_TRUE(found.good(0.75));
  EXPECT_FALSE(found.good(0.76));
}

TEST(StabilityOutcomes, NothingMayFailACheckHangCrashOrHaveNoCause) {
  const auto with = [](std::size_t member, Status status, const std::string& reason) {
    auto all = results();
    all[0].outcomes[member] = {status, "x", reason, 0};
    return verdict(all);
  };
  EXPECT_EQ(with(4, Status::done, "the volume of LV falls to -1 mL").check_failed, 1);
  EXPECT_FALSE(with(4, Status::done, "the volume of LV falls to -1 mL").good(0));
  EXPECT_EQ(with(4, Status::timeout, "late").hung, 1);
  EXPECT_FALSE(with(4, Status::timeout, "late").good(0));
  EXPECT_EQ(with(4, Status::failed, "crashed").crashed, 1);
  EXPECT_FALSE(with(4, Status::failed, "crashed").good(0));
  EXPECT_EQ(with(4, Status::unstable, "").unnamed, 1);
  EXPECT_FALSE(with(4, Status::unstable, "").good(0));
}

TEST(StabilityOutcomes, TheTableHasALineForEachGroupAndCause) {
  EXPECT_EQ(stability_csv(results()),
            "case,group,outcome,members,inside,first_member,at_ms,reason_of_first\n"
            "heart,defaults,\"done\",1,1,0,,\"\"\n"
            "heart,corners,\"done\",2,2,1,,\"\"\n"
            "heart,corners,\"unstable: ran away at # ms\",1,1,2,3.0,\"ran away at 3 ms\"\n"
            "heart,wild,\"unstable: ran away at # ms\",1,0,4,4.0,\"ran away at 4 ms\"\n");
  const std::string report = stability_report(results());
  EXPECT_NE(report.find("heart        2       1      2    3.0  unstable: ran away at 3 ms"),
            std::string::npos)
      << report;
}

}  // namespace
}  // namespace cohort
