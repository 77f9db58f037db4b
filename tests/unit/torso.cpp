#include "solver/torso.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/verification/lead_samples.hpp"

namespace cohort {
namespace {

Scene coarse_scene(TorsoKind kind) {
  Scene scene;
  scene.torso = kind;
  declare_torso(scene.parameters, kind);
  if (kind != TorsoKind::unbounded) scene.parameters[scene.parameters.index("torso.dx_mm")].value = 20;
  return scene;
}

TEST(Pose, IsARightHandedRotationThatPutsThePoint) {
  const Scene scene = coarse_scene(TorsoKind::cylinder);
  std::vector<double> values = scene.parameters.values();
  scene.parameters.resolve(values);
  const Pose pose = heart_pose(scene.parameters, values);
  const auto& m = pose.rotation;
  const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                             m[2] * (m[3] * m[7] - m[4] * m[6]);
  EXPECT_NEAR(determinant, 1, 1e-12);
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      EXPECT_NEAR(m[a] * m[b] + m[3 + a] * m[3 + b] + m[6 + a] * m[6 + b], a == b ? 1 : 0, 1e-12);
  const Point put = pose({10, 0, -36});
  EXPECT_NEAR(put[0], 29, 1e-12);
  EXPECT_NEAR(put[1], -33, 1e-12);
  EXPECT_NEAR(put[2], -3, 1e-12);
  // Anatomy: the apex points left, forwards and down; the right ventricle lies to the right and front of the
  // left one.
  EXPECT_GT(-m[2], 0.4);
  EXPECT_LT(-m[5], -0.4);
  EXPECT_NEAR(-m[8], -std::sin(33 * std::numbers::pi / 180), 1e-12);
  EXPECT_LT(m[0], -0.4);
  EXPECT_LT(m[3], -0.4);
}

TEST(Pose, ThePointFollowsTheHeartsLengthAndScale) {
  Scene scene;
  scene.ecg.emplace();
  declare_parameters(scene);
  scene.parameters[scene.parameters.index("geometry.heart.lv_length_mm")].value = 100;
  scene.parameters[scene.parameters.index("geometry.heart.scale")].value = 0.5;
  std::vector<double> values = scene.parameters.values();
  scene.parameters.resolve(values);
  const Point put = heart_pose(scene.parameters, values)({5, 0, -20});
  EXPECT_NEAR(put[0], 29, 1e-12);
  EXPECT_NEAR(put[1], -33, 1e-12);
  EXPECT_NEAR(put[2], -3, 1e-12);
}

TEST(Electrodes, LieOnTheSkinWhateverTheSizes) {
  for (const TorsoKind kind : {TorsoKind::box, TorsoKind::ellipsoid, TorsoKind::cylinder}) {
    const Scene scene = coarse_scene(kind);
    std::vector<double> values = scene.parameters.values();
    const auto set = [&](const char* path, double v) {
      values[static_cast<std::size_t>(scene.parameters.index(path))] = v;
    };
    set("torso.half_width_mm", 150);
    set("torso.half_depth_mm", 140);
    for (std::size_t e = 2; e < 9; ++e) {
      const Point p = electrode_places(kind, scene.parameters, values)[e];
      const double x = std::abs(p[0] / 150), y = std::abs(p[1] / 140), z = std::abs(p[2] + 25) / 225;
      const double level = kind == TorsoKind::box         ? std::max(x, y)
                           : kind == TorsoKind::ellipsoid ? std::hypot(x, y, z)
                                                          : std::pow(x, 2.5) + std::pow(y, 2.5);
      EXPECT_NEAR(level, 1, 1e-12) << electrode_names[e];
    }
  }
}

TEST(Torso, EveryParameterChangesTheSampledFields) {
  Device device(devices().at(0));
  for (const TorsoKind kind :
       {TorsoKind::box, TorsoKind::ellipsoid, TorsoKind::cylinder, TorsoKind::unbounded}) {
    Scene scene = coarse_scene(kind);
    for (Parameter parameter : scene.parameters.all())  // none at the ratio 1, where there is no inclusion
      if (parameter.path.ends_with(".conductivity_ratio"))
        scene.parameters[scene.parameters.index(parameter.path)].value = 0.5;
    Torso torso(device, scene);
    const std::vector<double> values = scene.parameters.values();
    const std::vector<Point> points = {{3, 7, -20}, {-11, 2, -45}};
    const std::vector<double> before = sample(device, scene, torso, values, points, true);
    for (int i = 0; i < scene.parameters.size(); ++i) {
      std::vector<double> changed = values;
      changed[static_cast<std::size_t>(i)] = values[static_cast<std::size_t>(i)] * 0.8 + 3;
      if (scene.parameters[i].path == "torso.dx_mm") changed[static_cast<std::size_t>(i)] = 17;
      SCOPED_TRACE(scene.parameters[i].path);
      EXPECT_NE(sample(device, scene, torso, changed, points, true), before) << scene.parameters[i].path;
    }
    EXPECT_EQ(sample(device, scene, torso, values, points, true), before) << "same inputs, same bytes";
  }
}

TEST(Torso, SolvesOnlyWhenTheFieldsChange) {
  Device device(devices().at(0));
  const Scene scene = coarse_scene(TorsoKind::cylinder);
  Torso torso(device, scene);
  std::vector<double> values = scene.parameters.values();
  const auto set = [&](const char* path, double v) {
    values[static_cast<std::size_t>(scene.parameters.index(path))] = v;
  };
  torso.fields(values);
  set("torso.heart.roll_deg", 5);
  set("torso.conductivity_mS_per_mm", 0.3);
  torso.fields(values);
  EXPECT_EQ(torso.solves(), 1);
  set("torso.electrodes.V3_mm.z", 1);
  torso.fields(values);
  EXPECT_EQ(torso.solves(), 2);
}

TEST(Torso, StatesItsMemoryBeforehand) {
  Device device(devices().at(0));
  const Scene scene = coarse_scene(TorsoKind::cylinder);
  Torso torso(device, scene);
  const std::vector<double> values = scene.parameters.values();
  const std::size_t stated = torso.bytes(values), before = device.allocated_bytes();
  torso.fields(values);
  const std::size_t taken = device.allocated_bytes() - before;
  EXPECT_LE(taken, stated);
  EXPECT_GT(static_cast<double>(taken), 0.99 * static_cast<double>(stated));
}

}  // namespace
}  // namespace cohort
