// A batch of members through the whole solver, on a coarse heart.
#include "solver/simulation.hpp"

#include <cmath>
#include <cstring>
#include <functional>

#include "tests/kernel_copy.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

Scene coarse_heart() {
  Scene scene;
  scene.geometry = GeometryKind::heart;
  scene.ecg.emplace();
  scene.activation.emplace();
  scene.stimuli = {{"sinus", Stimulus::Kind::site, "sinoatrial_node"}};
  declare_parameters(scene);
  const auto set = [&](const char* path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  };
  set("grid.dx_mm", 5);
  set("time.end_ms", 40);
  set("outputs.ecg.rate_hz", 500);
  set("torso.dx_mm", 20);
  set("stimuli.sinus.radius_mm", 10);
  set("electrophysiology.conductivity_longitudinal_mS_per_mm", 2);
  set("electrophysiology.conductivity_transverse_mS_per_mm", 2);
  return scene;
}

Member member(const Scene& scene, std::int64_t id, std::vector<std::pair<std::string, double>> changes) {
  Member result{id, scene.parameters.values()};
  for (const auto& [path, value] : changes)
    result.values[static_cast<size_t>(scene.parameters.index(path))] = value;
  scene.parameters.resolve(result.values);
  return result;
}

std::vector<Recording> run(const Scene& scene, const std::vector<Member>& members, int batch,
                           double timeout_s = 600) {
  PlanOptions options;
  options.members_per_device = batch;
  const Plan plan = make_plan(device(), scene, members, options);
  Simulation simulation(device(), scene, plan);
  std::vector<Recording> recordings;
  for (size_t first = 0; first < members.size(); first += static_cast<size_t>(batch)) {
    const size_t count = std::min(static_cast<size_t>(batch), members.size() - first);
    for (Recording& recording : simulation.run(std::span(members).subspan(first, count), timeout_s))
      recordings.push_back(std::move(recording));
  }
  return recordings;
}

const std::string tau_close = "electrophysiology.mitchell_schaeffer.tau_close_ms";
const std::string tau_in = "electrophysiology.mitchell_schaeffer.tau_in_ms";

TEST(DeviceErrors, NameTheCallAndTheError) {
  EXPECT_STREQ(DeviceError(cl::Error(CL_OUT_OF_RESOURCES, "clFinish")).what(),
               "clFinish: CL_OUT_OF_RESOURCES (-5)");
  EXPECT_STREQ(DeviceError(cl::Error(-4711, "clFinish")).what(), "clFinish: error (-4711)");
}

TEST(Simulation, AMembersBytesDoNotDependOnItsBatch) {
  const Scene scene = coarse_heart();
  const std::vector<Member> members = {
      member(scene, 0, {}), member(scene, 1, {{tau_close, 120}, {"geometry.heart.lv_radius_mm", 27}}),
      // Its own step (a faster cell), its own torso, an action potential of its own in one region.
      member(scene, 2, {{tau_in, 0.1}}), member(scene, 3, {{"torso.half_width_mm", 185}}),
      member(scene, 4, {{"electrophysiology.regions.la.tau_close_ms", 60}})};
  std::vector<Member> all = members;
  const std::vector<Recording> alone = run(scene, all, 1), together = run(scene, all, 5),
                               pairs = run(scene, all, 2);
  for (size_t m = 0; m < all.size(); ++m) {
    ASSERT_EQ(alone[m].outcome, Outcome::done) << alone[m].reason;
    for (const std::vector<Recording>* other : {&together, &pairs}) {
      const Recording& recording = (*other)[m];
      ASSERT_EQ(recording.outcome, Outcome::done) << recording.reason;
      EXPECT_EQ(recording.dt_ms, alone[m].dt_ms);
      ASSERT_EQ(recording.ecg.size(), alone[m].ecg.size());
      EXPECT_EQ(std::memcmp(recording.ecg.data(), alone[m].ecg.data(), alone[m].ecg.size() * sizeof(float)),
                0)
          << m;
      EXPECT_EQ(std::memcmp(recording.features.data(), alone[m].features.data(),
                            alone[m].features.size() * sizeof(float)),
                0)
          << m;
    }
  }
  EXPECT_LT(alone[2].dt_ms, alone[0].dt_ms);
  EXPECT_NE(alone[3].ecg, alone[0].ecg);
  EXPECT_NE(alone[1].ecg, alone[0].ecg);
}

// coarse_heart() with more structure, for 20 ms: atria alone.
Scene coarse_atria(const std::function<void(Scene&)>& structure) {
  const Scene plain = coarse_heart();
  Scene scene;
  scene.geometry = plain.geometry;
  scene.ecg = plain.ecg;
  scene.activation = plain.activation;
  scene.stimuli = plain.stimuli;
  structure(scene);
  declare_parameters(scene);
  for (const Parameter& parameter : plain.parameters.all())
    if (const int index = scene.parameters.find(parameter.path); index >= 0)
      scene.parameters[index].value = parameter.value;
  scene.parameters[scene.parameters.index("time.end_ms")].value = 20;
  return scene;
}

void expect_independent(const Scene& scene, const std::vector<Member>& members) {
  const std::vector<Recording> alone = run(scene, members, 1),
                               together = run(scene, members, static_cast<int>(members.size()));
  for (size_t m = 0; m < members.size(); ++m) {
    ASSERT_EQ(alone[m].outcome, Outcome::done) << alone[m].reason;
    EXPECT_EQ(together[m].dt_ms, alone[m].dt_ms);
    EXPECT_EQ(together[m].ecg, alone[m].ecg) << m;
    ASSERT_EQ(together[m].features.size(), alone[m].features.size());
    EXPECT_EQ(std::memcmp(together[m].features.data(), alone[m].features.data(),
                          alone[m].features.size() * sizeof(float)),
              0)
        << m;
    if (m > 0) {
      EXPECT_NE(alone[m].ecg, alone[0].ecg) << m;
    }
  }
}

TEST(Simulation, AMembersBytesDoNotDependOnTheSlopesOfOthers) {
  const Scene scene = coarse_atria([](Scene& s) {
    s.heterogeneity = {{"tau_close_ms", "tau_in_ms"}, {"lv", "ra"}};
  });
  const std::string slope = "electrophysiology.heterogeneity.";
  const std::vector<Member> members = {
      member(scene, 0, {}), member(scene, 1, {{slope + "tau_close_ms.apico_basal", -90}}),
      member(scene, 2, {{slope + "tau_in_ms.midmyocardial", -0.1}}),  // a step of its own
      member(scene, 3, {{slope + "tau_in_ms.lateral", 0.05}, {slope + "tau_close_ms.transmural", -80}})};
  expect_independent(scene, members);
  EXPECT_LT(run(scene, {members[2]}, 1)[0].dt_ms, run(scene, {members[0]}, 1)[0].dt_ms);
}

TEST(Simulation, AMembersBytesDoNotDependOnItsBatchWithSeveralModels) {
  const Scene scene = coarse_atria([](Scene& s) {
    s.region_cell_models = {{"ra", "ten_tusscher_panfilov"}};
  });
  expect_independent(
      scene, {member(scene, 0, {}), member(scene, 1, {{"electrophysiology.ten_tusscher_panfilov.gNa", 12}}),
              member(scene, 2, {{tau_in, 0.25}, {"geometry.heart.ra_radius_mm.x", 22}})});
}

TEST(Simulation, LimbLeadsAreExactCombinationsAndNothingIsUndefined) {
  const Scene scene = coarse_heart();
  const Recording recording = run(scene, {member(scene, 0, {})}, 1)[0];
  const std::size_t samples = layout(scene).ecg_ms.size();
  ASSERT_EQ(samples, 20u);
  double largest = 0;
  for (std::size_t k = 0; k < samples; ++k) {
    const auto lead = [&](std::size_t l) { return recording.ecg[l * samples + k]; };
    EXPECT_EQ(lead(2), lead(1) - lead(0));
    EXPECT_NEAR(lead(0) + lead(2), lead(1), 1e-6 * (std::abs(lead(0)) + std::abs(lead(1))));
    EXPECT_NEAR(lead(3) + lead(4) + lead(5), 0, 1e-6 * (std::abs(lead(0)) + std::abs(lead(1))));
    for (std::size_t l = 0; l < 12; ++l) {
      EXPECT_TRUE(std::isfinite(lead(l)));
      largest = std::max(largest, std::abs(static_cast<double>(lead(l))));
    }
  }
  EXPECT_GT(largest, 0.001);
  EXPECT_LT(largest, 10);
}

TEST(Simulation, ACirculationBesideTissueLeavesTheEcgAsItIs) {
  const auto structure = [](bool blood) {
    Scene scene;
    scene.ecg.emplace();
    scene.stimuli = {{"sinus", Stimulus::Kind::site, "sinoatrial_node"}};
    if (blood) scene.circulation.emplace();
    if (blood) scene.pv.emplace();
    declare_parameters(scene);
    const Scene plain = coarse_heart();
    for (const Parameter& parameter : plain.parameters.all())
      if (const int index = scene.parameters.find(parameter.path); index >= 0)
        scene.parameters[index].value = parameter.value;
    return scene;
  };
  const Scene with = structure(true), without = structure(false);
  const Recording both = run(with, {member(with, 0, {})}, 1)[0],
                  one = run(without, {member(without, 0, {})}, 1)[0];
  ASSERT_EQ(both.outcome, Outcome::done) << both.reason;
  EXPECT_EQ(both.ecg, one.ecg);
  EXPECT_EQ(both.dt_ms, one.dt_ms);
  const Layout shapes = layout(with);
  ASSERT_EQ(both.features.size(), shapes.features.size());
  ASSERT_EQ(both.pressure.size(), shapes.compartments.size() * shapes.pv_ms.size());
  EXPECT_EQ(shapes.pv_ms.size(), 40u);  // all of time.end_ms: there are no beats
  EXPECT_EQ(std::memcmp(both.features.data(), one.features.data(), one.features.size() * sizeof(float)), 0);
  for (const float x : both.pressure) EXPECT_TRUE(std::isfinite(x));
}

TEST(Simulation, BeatsRecordTheEcgOfOne) {
  Scene scene;
  scene.ecg.emplace();
  scene.circulation.emplace();
  scene.beats.emplace();
  declare_parameters(scene);
  EXPECT_LT(scene.parameters.find("time.end_ms"), 0);
  scene.parameters[scene.parameters.index("time.beats.length_ms")].value = 700;
  EXPECT_EQ(layout(scene).ecg_ms.size(), 700u);
}

TEST(Simulation, AMemberThatCannotRunIsRejectedWithItsReasonAndTheOthersRun) {
  Scene scene = coarse_heart();
  const std::vector<Member> members = {
      member(scene, 0, {}), member(scene, 1, {{"stimuli.sinus.radius_mm", 0.01}}), member(scene, 2, {})};
  const std::vector<Recording> recordings = run(scene, members, 3);
  EXPECT_EQ(recordings[1].outcome, Outcome::rejected);
  EXPECT_NE(recordings[1].reason.find("stimulus \"sinus\" reaches no tissue"), std::string::npos)
      << recordings[1].reason;
  EXPECT_EQ(recordings[0].outcome, Outcome::done);
  EXPECT_EQ(recordings[0].ecg, recordings[2].ecg);
}

TEST(Simulation, AnUnstableMemberSaysWhenAndDoesNotTouchItsNeighbours) {
  Scene scene = coarse_heart();
  scene.activation_method = ActivationMethod::monodomain;  // reaction-eikonal rejects cells without a front
  scene.parameters[scene.parameters.index("time.dt_ms")].value = 0.1;
  const std::vector<Member> members = {member(scene, 0, {{tau_in, 0.2}}), member(scene, 1, {{tau_in, 0.5}})};
  // Upstrokes of the first are no number.
  const FaultyKernels faulty(
      "cells/mitchell_schaeffer.cl", "slope_middle, *V);",
      "slope_middle, *V);\n"
      "*V = WHERE(isgreater(middle, (realv)(R(0.5))) & isgreater(d[D_inverse_tau_in], (realv)(R(3.0))),"
      " (realv)(NAN), *V);");
  const std::vector<Recording> recordings = run(scene, members, 2);
  EXPECT_EQ(recordings[0].outcome, Outcome::unstable) << recordings[0].reason;
  EXPECT_EQ(recordings[0].reason.find("the potential is out of bounds, or no number, in "), 0u)
      << recordings[0].reason;
  EXPECT_GT(recordings[0].failed_at_ms, 0);
  EXPECT_LE(recordings[0].failed_at_ms, 40);
  EXPECT_EQ(recordings[1].outcome, Outcome::done) << recordings[1].reason;
  EXPECT_EQ(recordings[1].ecg, run(scene, {members[1]}, 1)[0].ecg);
}

TEST(Simulation, AStepBeyondWhatTheReactionBearsEndsItsMemberAlone) {
  Scene scene = coarse_heart();
  scene.activation_method = ActivationMethod::monodomain;
  scene.parameters[scene.parameters.index("time.dt_ms")].value = 2;
  const std::vector<Member> members = {member(scene, 0, {{tau_in, 0.05}}), member(scene, 1, {{tau_in, 5}})};
  const std::vector<Recording> recordings = run(scene, members, 2);
  EXPECT_EQ(recordings[0].outcome, Outcome::unstable);
  EXPECT_EQ(recordings[0].failed_at_ms, 0);
  EXPECT_EQ(recordings[0].reason.find("the reaction's step of 2 ms is beyond the limit of 0.09"), 0u)
      << recordings[0].reason;
  EXPECT_EQ(recordings[1].outcome, Outcome::done) << recordings[1].reason;
}

// A bar on a grid so fine that diffusion takes several substeps.
Scene fine_bar(double dt_ms, bool ecg) {
  Scene scene;
  scene.geometry = GeometryKind::box;
  scene.activation.emplace();
  if (ecg) scene.ecg.emplace();
  scene.torso = TorsoKind::unbounded;
  scene.stimuli = {{"end", Stimulus::Kind::box, ""}};
  declare_parameters(scene);
  const auto set = [&](const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  };
  set("geometry.box.size_mm.x", 8);
  set("geometry.box.size_mm.y", 0.4);
  set("geometry.box.size_mm.z", 0.4);
  set("grid.dx_mm", 0.1);
  set("time.end_ms", 14);
  set("time.dt_ms", dt_ms);
  set("electrophysiology.conductivity_longitudinal_mS_per_mm", 2);
  set("electrophysiology.conductivity_transverse_mS_per_mm", 2);
  return scene;
}

TEST(Simulation, SubstepsKeepMembersApart) {
  Scene scene = fine_bar(0.1, false);
  const std::string amplitude = "stimuli.end.amplitude_mV_per_ms";
  const std::vector<Member> members = {member(scene, 0, {{amplitude, 1000}, {tau_in, 0.05}}),
                                       member(scene, 1, {})};
  const std::vector<Recording> together = run(scene, members, 2), alone = run(scene, {members[1]}, 1);
  EXPECT_EQ(together[0].outcome, Outcome::unstable);
  EXPECT_EQ(together[1].outcome, Outcome::done) << together[1].reason;
  EXPECT_EQ(together[1].features, alone[0].features);
}

TEST(Simulation, SubstepsLoseNoActivation) {
  // Times with many substeps against those with a step so short that there is one.
  const auto features = [](double dt) {
    const Scene scene = fine_bar(dt, false);
    return run(scene, {member(scene, 0, {})}, 1)[0].features;
  };
  const std::vector<float> many = features(0.05), one = features(0.001);
  ASSERT_EQ(many.size(), 3u);
  EXPECT_EQ(many[2], 1.0f);  // all cells are activated
  EXPECT_EQ(one[2], 1.0f);
  EXPECT_NEAR(many[1], one[1], 0.15) << "the last activation";
  EXPECT_NEAR(many[0], one[0], 0.05) << "the first activation";
}

TEST(Simulation, SamplesAreStableWithSubsteps) {
  const auto ecg = [](double dt) {
    const Scene scene = fine_bar(dt, true);
    return run(scene, {member(scene, 0, {{"stimuli.end.amplitude_mV_per_ms", 200}})}, 1)[0];
  };
  const Recording many = ecg(0.1), one = ecg(0.001);
  ASSERT_EQ(many.outcome, Outcome::done) << many.reason;
  ASSERT_EQ(one.outcome, Outcome::done) << one.reason;
  double difference = 0, size = 0;
  for (size_t k = 0; k < one.ecg.size(); ++k) {
    difference =
        std::max(difference, std::abs(static_cast<double>(many.ecg[k]) - static_cast<double>(one.ecg[k])));
    size = std::max(size, std::abs(static_cast<double>(one.ecg[k])));
  }
  EXPECT_LT(difference, 0.05 * size);
}

TEST(Simulation, AHeartOutsideTheTorsoIsRejected) {
  const Scene scene = coarse_heart();
  const std::vector<Recording> recordings =
      run(scene, {member(scene, 0, {{"torso.heart.position_mm.x", 300}}), member(scene, 1, {})}, 2);
  EXPECT_EQ(recordings[0].outcome, Outcome::rejected);
  EXPECT_NE(recordings[0].reason.find("inside the torso"), std::string::npos) << recordings[0].reason;
  EXPECT_EQ(recordings[1].outcome, Outcome::done) << recordings[1].reason;
}

TEST(Simulation, TimesOut) {
  Scene scene = coarse_heart();
  scene.parameters[scene.parameters.index("time.end_ms")].value = 1000;
  const Recording recording = run(scene, {member(scene, 0, {})}, 1, 0.01)[0];
  EXPECT_EQ(recording.outcome, Outcome::timeout);
  EXPECT_NE(recording.reason.find("not finished after"), std::string::npos);
}

TEST(Simulation, AGivenStepMustDivideTheSamplingInterval) {
  Scene scene = coarse_heart();
  scene.parameters[scene.parameters.index("time.dt_ms")].value = 0.03;
  EXPECT_THROW(make_plan(device(), scene, {}, {}), std::invalid_argument);
}

TEST(Simulation, AnEcgIsTheSameWhateverElseIsRecorded) {
  Scene scene = coarse_heart();
  const Recording both = run(scene, {member(scene, 0, {})}, 1)[0];
  scene.activation.reset();
  const Recording ecg_alone = run(scene, {member(scene, 0, {})}, 1)[0];
  EXPECT_EQ(both.ecg, ecg_alone.ecg);
  // The measures of the ECG stand behind those of the activation.
  const size_t measures = ecg_alone.features.size();
  ASSERT_LT(measures, both.features.size());
  EXPECT_EQ(std::memcmp(both.features.data() + (both.features.size() - measures), ecg_alone.features.data(),
                        measures * sizeof(float)),
            0);
}

TEST(Vertices, CountTheCellsAroundThem) {
  Slab slab({3, 2, 1}, 1, Precision::single_, "mitchell_schaeffer", {});
  const std::vector<std::uint8_t> types = slab.tissue->vertices(1);
  // A box of 3 x 2 x 1 cells has 4 x 3 x 2 vertices, all on its surface.
  EXPECT_EQ(std::count(types.begin(), types.end(), 1), 0);
  EXPECT_EQ(std::count(types.begin(), types.end(), 2), 24);
  Slab cube({4, 4, 4}, 1, Precision::single_, "mitchell_schaeffer", {});
  const std::vector<std::uint8_t> cube_types = cube.tissue->vertices(1);
  EXPECT_EQ(std::count(cube_types.begin(), cube_types.end(), 1), 27);
  EXPECT_EQ(std::count(cube_types.begin(), cube_types.end(), 2), 125 - 27);
}

}  // namespace
}  // namespace cohort::test
