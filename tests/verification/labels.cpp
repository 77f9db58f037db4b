// Label maps as hearts: where a map lands, what a heart loses on its way through one, and the walls that are
// grown.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>

#include "ensemble/config.hpp"
#include "solver/export_labels.hpp"
#include "solver/geometry.hpp"
#include "tests/slab.hpp"

namespace {

using namespace cohort;
using Vector = std::array<double, 3>;

Scene label_scene(LabelImage image, const std::string& convention, std::optional<LabelFrame> frame, double dx,
                  LabelTable extra = {}) {
  Scene scene;
  scene.geometry = GeometryKind::labels;
  LabelTable table = convention.empty() ? LabelTable{{0, "background"}} : label_table(convention);
  for (const auto& [value, name] : extra) table[value] = name;
  scene.labels = std::make_shared<LabelHeart>(std::move(image), "test", convention, table, frame);
  scene.ecg.emplace();
  scene.activation.emplace();
  declare_parameters(scene);
  scene.parameters[scene.parameters.index("grid.dx_mm")].value = dx;
  return scene;
}

Member own_member(const Scene& scene) {
  Member member{0, scene.parameters.values()};
  scene.parameters.resolve(member.values);
  return member;
}

/// An image of `cells` voxels with the value that `label` gives at each voxel's place in the world.
template <class Label>
LabelImage image_of(const std::array<int, 3>& cells, const Affine& to_world, Label label) {
  LabelImage image;
  image.cells = cells;
  image.to_world = to_world;
  image.labels = {0, 1, 2, 3};
  image.counts.assign(4, 0);
  for (int z = 0; z < cells[2]; ++z)
    for (int y = 0; y < cells[1]; ++y)
      for (int x = 0; x < cells[0]; ++x) {
        const int value = label(to_world({double(x), double(y), double(z)}));
        image.voxels.push_back(static_cast<std::uint8_t>(value));
        ++image.counts[size_t(value)];
      }
  return image;
}

Affine oblique(bool flipped) {
  // Voxels of 0.8 x 1.1 x 2.3 mm, turned by 30 degrees about z and 20 about x, the first axis reversed.
  const double edge[] = {flipped ? -0.8 : 0.8, 1.1, 2.3}, a = std::numbers::pi / 6, b = std::numbers::pi / 9;
  const double rotation[3][3] = {{std::cos(a), -std::sin(a) * std::cos(b), std::sin(a) * std::sin(b)},
                                 {std::sin(a), std::cos(a) * std::cos(b), -std::cos(a) * std::sin(b)},
                                 {0, std::sin(b), std::cos(b)}};
  Affine affine;
  const Vector middle = {47.5, 39.5, 17.5}, world = {12, -31, 47};
  for (size_t i = 0; i < 3; ++i) {
    affine.row[i][3] = world[i];
    for (size_t j = 0; j < 3; ++j) {
      affine.row[i][j] = rotation[i][j] * edge[j];
      affine.row[i][3] -= affine.row[i][j] * middle[j];
    }
  }
  return affine;
}

/// Through a file, as a campaign reads it.
LabelImage through_file(const LabelImage& image) {
  const std::string name =
      (std::filesystem::temp_directory_path() / (std::to_string(getpid()) + "_labels.nii.gz")).string();
  write_label_image(name, image);
  LabelImage result = read_label_image(name);
  std::filesystem::remove(name);
  return result;
}

TEST(LabelMaps, AnAnisotropicRotatedFlippedMapLandsInItsPlace) {
  // A large ellipsoid, and a ball on its right only: swapped sides would show.
  const Vector centre = {10, -30, 45}, radii = {20, 14, 17}, ball = {38, -26, 50};
  const double ball_radius = 7;
  for (const bool flipped : {false, true}) {
    const LabelImage image = through_file(image_of({96, 80, 36}, oblique(flipped), [&](const Vector& p) {
      const double e = std::hypot((p[0] - centre[0]) / radii[0], (p[1] - centre[1]) / radii[1],
                                  (p[2] - centre[2]) / radii[2]);
      const double b = std::hypot(p[0] - ball[0], p[1] - ball[1], p[2] - ball[2]);
      return b < ball_radius ? 2 : e < 1 ? 1 : 0;
    }));
    const Scene scene = label_scene(image, "", LabelFrame::image, 1, {{1, "muscle"}, {2, "ball"}});
    const auto cells = label_cells(scene);
    Vector sum{}, ball_sum{}, lower{1e9, 1e9, 1e9}, upper{-1e9, -1e9, -1e9};
    double volume = 0, ball_volume = 0;
    for (const std::int32_t cell : cells->tissue) {
      const auto i = static_cast<size_t>(cell);
      const Grid& g = cells->grid;
      const Vector p = {g.origin_mm[0] + g.dx_mm * (cell % g.cells[0] + 0.5),
                        g.origin_mm[1] + g.dx_mm * (cell / g.cells[0] % g.cells[1] + 0.5),
                        g.origin_mm[2] + g.dx_mm * (cell / (g.cells[0] * g.cells[1]) + 0.5)};
      const bool in_ball = scene.regions[cells->region[i]].name == "ball";
      const double f = double(cells->fraction[i]);
      (in_ball ? ball_volume : volume) += f;
      for (size_t a = 0; a < 3; ++a) {
        (in_ball ? ball_sum : sum)[a] += f * p[a];
        if (!in_ball && f > 0.5) {
          lower[a] = std::min(lower[a], p[a] - 0.5);
          upper[a] = std::max(upper[a], p[a] + 0.5);
        }
      }
    }
    // Against the voxels' own sums; cells with less than a twentieth of tissue hold none.
    const double voxel = 0.8 * 1.1 * 2.3;
    EXPECT_NEAR(volume / (double(image.counts[1]) * voxel), 1, 0.01);
    EXPECT_NEAR(ball_volume / (double(image.counts[2]) * voxel), 1, 0.02);
    EXPECT_NEAR(double(image.counts[1]) * voxel / (4 * std::numbers::pi / 3 * radii[0] * radii[1] * radii[2]),
                1, 0.01);
    for (size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(sum[a] / volume, centre[a], 0.1) << "axis " << a;
      EXPECT_NEAR(ball_sum[a] / ball_volume, ball[a], 0.2) << "axis " << a;
      EXPECT_NEAR(lower[a], centre[a] - radii[a], 1.2) << "axis " << a;
      EXPECT_NEAR(upper[a], centre[a] + radii[a], 1.2) << "axis " << a;
    }
  }
}

/// The schematic heart as in configs/ecg.yaml, its ventricles paced, so that no delay of the conduction
/// path enters.
struct Schematic {
  static constexpr double dx = 2;
  Scene scene;
  Schematic() {
    scene.geometry = GeometryKind::heart;
    scene.ecg.emplace();
    scene.activation.emplace();
    pace(scene);
    declare_parameters(scene);
    set(scene);
  }
  static void pace(Scene& s) { s.stimuli = {{"septum", Stimulus::Kind::sphere, {}}}; }
  static void set(Scene& s) {
    const auto put = [&](const char* path, double value) {
      s.parameters[s.parameters.index(path)].value = value;
    };
    put("grid.dx_mm", dx);
    put("time.end_ms", 120);
    put("electrophysiology.conductivity_longitudinal_mS_per_mm", 5);
    put("electrophysiology.conductivity_transverse_mS_per_mm", 3);
    put("stimuli.septum.centre_mm.x", 29);
    put("stimuli.septum.centre_mm.z", -45);
    put("stimuli.septum.radius_mm", 6);
  }
};

std::vector<float> ecg_of(const Scene& scene) {
  const Member member = own_member(scene);
  const std::span<const Member> one(&member, 1);
  const Plan plan = make_plan(test::device(), scene, one, {});
  Simulation simulation(test::device(), scene, plan);
  const auto recordings = simulation.run(one, 600);
  EXPECT_EQ(recordings[0].outcome, Outcome::done) << recordings[0].reason;
  return recordings[0].ecg;
}

LabelImage exported(const Scene& scene, double spacing) {
  return label_image(test::device(), scene, own_member(scene), spacing);
}

/// Relative RMS difference of two ECGs over all leads.
double difference_of(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0, size = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    difference += std::pow(double(a[i] - b[i]), 2);
    size += std::pow(double(a[i]), 2);
  }
  return std::sqrt(difference / size);
}

TEST(LabelMaps, AHeartThatIsWrittenAndReadBackHasTheSameEcg) {
  const Schematic heart;
  const LabelImage image = through_file(exported(heart.scene, 0.5));
  Scene back;
  back.geometry = GeometryKind::labels;
  back.labels = std::make_shared<LabelHeart>(image, "test", "cohort", label_table("cohort"), std::nullopt);
  back.ecg.emplace();
  back.activation.emplace();
  Schematic::pace(back);
  declare_parameters(back);
  Schematic::set(back);
  const std::vector<float> a = ecg_of(heart.scene), b = ecg_of(back);
  ASSERT_EQ(a.size(), b.size());
  std::printf("relative RMS difference %.4f\n", difference_of(a, b));
  EXPECT_LT(difference_of(a, b), 0.02);

  // The sites are those of the schematic heart: the file names them.
  const Member member = own_member(heart.scene);
  for (const std::string& name : stimulus_sites(GeometryKind::heart)) {
    const Sphere there = site(heart.scene, name, member.values), here = site(back, name, {});
    for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(here.centre[axis], there.centre[axis], 1e-4) << name;
    EXPECT_NEAR(here.radius, there.radius, 1e-4) << name;
  }
}

// What is lost: distances to a surface of voxels scatter by 0.04 mm, blood where it ends in a sharp edge,
// where the right ventricle's wall meets the septum.
TEST(LabelMaps, TheDefaultHeartsBeatIsTheSame) {
  const Scene scene = read_campaign(COHORT_SOURCE_DIR "/configs/ecg.yaml").scene;
  Scene back = read_campaign(COHORT_SOURCE_DIR "/configs/labels.yaml").scene;
  const auto image = through_file(exported(scene, 0.5));
  back.labels = std::make_shared<LabelHeart>(image, "test", "cohort", label_table("cohort"), std::nullopt);
  // The same parameters, or the example has fallen behind.
  const std::vector<double> schematic = own_member(scene).values, labelled = own_member(back).values;
  for (size_t k = 0; k < labelled.size(); ++k) {
    const std::string& path = back.parameters.all()[k].path;
    if (const int i = scene.parameters.find(path); i >= 0) {
      EXPECT_EQ(labelled[k], schematic[static_cast<size_t>(i)]) << path;
    }
  }
  const std::vector<float> a = ecg_of(scene), b = ecg_of(back);
  ASSERT_EQ(a.size(), b.size());
  std::printf("relative RMS difference %.4f\n", difference_of(a, b));
  EXPECT_LT(difference_of(a, b), 0.02);
}

double blood_mL(const LabelImage& image, std::int32_t label) {
  const auto edges = image.spacing_mm();
  for (size_t i = 0; i < image.labels.size(); ++i)
    if (image.labels[i] == label) return double(image.counts[i]) * edges[0] * edges[1] * edges[2] / 1000;
  return 0;
}

TEST(LabelMaps, VolumesAreThoseOfTheVoxels) {
  const Schematic heart;
  const LabelImage image = exported(heart.scene, 0.5);
  // Cavities of the schematic heart, as heart_geometry.cpp has them: 132, 145, 53, 68 mL.
  EXPECT_NEAR(blood_mL(image, 11), 132, 0.01 * 132);
  EXPECT_NEAR(blood_mL(image, 12), 145, 0.02 * 145);
  EXPECT_NEAR(blood_mL(image, 13), 53, 0.02 * 53);
  EXPECT_NEAR(blood_mL(image, 14), 68, 0.02 * 68);
  const Scene back = label_scene(image, "cohort", {}, 2);
  const auto cells = label_cells(back);
  for (Part blood = lv_blood_part; blood <= ra_blood_part; ++blood)
    EXPECT_NEAR(cells->volume_mL[blood] / blood_mL(image, 10 + blood), 1, 0.01);
  for (size_t r = 0; r < 2; ++r) {  // ventricles: nothing but slivers of cells is lost
    double volume = 0;
    for (size_t i = 0; i < cells->region.size(); ++i)
      if (cells->region[i] == r) volume += double(cells->fraction[i]) * std::pow(2.0, 3) / 1000;
    EXPECT_NEAR(volume / blood_mL(image, std::int32_t(r) + 1), 1, 0.01) << back.regions[r].name;
  }
}

/// The schematic heart as MM-WHS labels it: blood and the left ventricle's wall, no other tissue.
LabelImage as_mm_whs(LabelImage image) {
  std::vector<std::int32_t> meaning(256, 0);
  meaning[1] = meaning[5] = 205;  // the path runs in the septum
  meaning[11] = 500;
  meaning[12] = 600;
  meaning[13] = 420;
  meaning[14] = 550;
  LabelImage result = image;
  result.labels = {0, 205, 420, 500, 550, 600};
  result.counts.assign(6, 0);
  for (auto& voxel : result.voxels) {
    const auto place =
        std::find(result.labels.begin(), result.labels.end(), meaning[size_t(image.labels[voxel])]) -
        result.labels.begin();
    voxel = static_cast<std::uint8_t>(place);
    ++result.counts[voxel];
  }
  return result;
}

TEST(LabelMaps, WallsAreGrownWhereTheConventionHasNone) {
  const Schematic heart;
  // Moved and turned: the frame has to be found.
  LabelImage image = as_mm_whs(exported(heart.scene, 1));
  Affine moved = oblique(false);
  for (auto& row : moved.row) row[3] = 0;
  const double edges[] = {0.8, 1.1, 2.3};
  for (auto& row : moved.row)
    for (size_t j = 0; j < 3; ++j) row[j] /= edges[j];
  moved.row[0][3] = 80;
  moved.row[2][3] = -150;
  image.to_world = compose(moved, image.to_world);
  const Scene scene = label_scene(image, "MM-WHS", {}, 2);
  const Affine total = compose(scene.labels->to_heart, moved);
  for (size_t i = 0; i < 3; ++i)
    EXPECT_GT(total.row[i][i], std::cos(12 * std::numbers::pi / 180)) << "axis " << i;
  EXPECT_NEAR(total.row[2][3], 0, 3);

  const auto cells = label_cells(scene);
  std::vector<std::string> names;
  for (const Region& r : scene.regions) names.push_back(r.name);
  EXPECT_EQ(names, (std::vector<std::string>{"lv", "rv", "la", "ra", "conduction_path", "insulator"}));
  // As much right ventricular wall as the schematic heart has, 6 mm and more below the AV plane: at the plane
  // its plate, which the labels leave out, keeps the blood of the ventricle from that of the atrium.
  const LabelImage whole = exported(heart.scene, 1);
  double voxels = 0, wall = 0;
  for (size_t v = 0; v < whole.voxels.size(); ++v) {
    const int layer = int(v / (size_t(whole.cells[0]) * size_t(whole.cells[1])));
    voxels += whole.labels[whole.voxels[v]] == 2 && whole.to_world({0, 0, double(layer)})[2] < -6;
  }
  const Grid& grid = cells->grid;
  for (const std::int32_t cell : cells->tissue) {
    const double z = grid.origin_mm[2] + grid.dx_mm * (cell / (grid.cells[0] * grid.cells[1]) + 0.5);
    if (cells->region[size_t(cell)] == 1 && z < -6) wall += double(cells->fraction[size_t(cell)]) * 8;
  }
  std::printf("grown wall over the schematic heart's %.4f\n", wall / voxels);
  EXPECT_NEAR(wall / voxels, 1, 0.07);
  // Only the path joins atria and ventricles.
  const auto& n = cells->grid.cells;
  const auto side = [&](size_t i) {
    return cells->region[i] == 255 ? 0 : cells->region[i] <= 1 ? 1 : cells->region[i] <= 3 ? 2 : 0;
  };
  int touching = 0;
  for (const std::int32_t cell : cells->tissue)
    for (const int step : {1, n[0], n[0] * n[1], 1 + n[0], n[0] - 1})
      touching += side(size_t(cell)) * side(size_t(cell + step)) == 2;
  EXPECT_EQ(touching, 0);
  for (const char* name : {"sinoatrial_node", "av_node", "his_bundle"})
    EXPECT_GT(site(scene, name, {}).radius, 0);
}

TEST(LabelMaps, VentriclesAloneAreAHeart) {
  const Schematic heart;
  LabelImage image = exported(heart.scene, 2);
  LabelImage acdc = image;
  acdc.labels = {0, 1, 2, 3};
  acdc.counts.assign(4, 0);
  for (auto& voxel : acdc.voxels) {
    const std::int32_t label = image.labels[voxel];
    voxel = label == 12 ? 1 : label == 1 || label == 5 ? 2 : label == 11 ? 3 : 0;
    ++acdc.counts[voxel];
  }
  const Scene scene = label_scene(acdc, "ACDC", {}, 2);
  ASSERT_EQ(scene.regions.size(), 2u);
  EXPECT_EQ(scene.regions[0].name, "lv");
  EXPECT_EQ(scene.regions[1].name, "rv");
  EXPECT_THROW(site(scene, "sinoatrial_node", {}), std::invalid_argument);
  const Member member = own_member(scene);
  EXPECT_GT(make_plan(test::device(), scene, {&member, 1}, {}).tissue_cells, 10000u);
}

}  // namespace
