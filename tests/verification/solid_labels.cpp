// Label maps that deform: the default heart through a label map against itself.
#include "solver/export_labels.hpp"
#include "solver/labels.hpp"
#include "solver/mechanics_structure.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

constexpr double dx = 4, voxel = 1;

Scene structure(GeometryKind geometry, const std::vector<std::string>& cavities) {
  Scene scene;
  scene.geometry = geometry;
  Mechanics& mechanics = scene.mechanics.emplace();
  mechanics.law = "holzapfel_ogden";  // with sheets: wall normals too
  for (const std::string& name : cavities) mechanics.cavities.push_back({name, {}});
  mechanics.boundary = default_heart_boundary(mechanics);
  mechanics.quasi_static = true;
  // A delay stands for the conduction path, as in configs/heart.yaml.
  scene.conduction_system.emplace().kind = ConductionSystem::Kind::delay;
  return scene;
}

Scene labelled(const LabelImage& image, const std::vector<std::string>& cavities) {
  Scene scene = structure(GeometryKind::labels, cavities);
  scene.labels = std::make_shared<LabelHeart>(image, "test", "cohort", label_table("cohort"), std::nullopt);
  return scene;
}

const LabelImage& default_heart() {
  static const LabelImage image = [] {
    Scene scene = structure(GeometryKind::heart, {"lv", "rv"});
    declare_parameters(scene);
    scene.parameters[scene.parameters.index("grid.dx_mm")].value = dx;
    Member member{0, scene.parameters.values()};
    scene.parameters.resolve(member.values);
    return label_image(device(), scene, member, voxel);
  }();
  return image;
}

std::vector<double> volumes(SolidRun& run) {
  run.measured(run.at_rest());
  const std::vector<double> S = run.solid->state();
  std::vector<double> result;
  for (std::size_t q = 0; q < run.scene.mechanics->cavities.size(); ++q)
    result.push_back(S[Solid::first_volume + q] / 1000);
  return result;
}

/// Mesh cells of member 0 by place in the world, in units of the spacing.
std::map<std::array<int, 3>, std::size_t> cells_of(const SolidRun& run) {
  std::map<std::array<int, 3>, std::size_t> result;
  for (int b = run.mesh().cell_blocks[0] * SolidMesh::block; b < run.mesh().cell_blocks[1] * SolidMesh::block;
       ++b) {
    const auto i = static_cast<std::size_t>(b);
    if (run.mesh().grid_cell[i] < 0) continue;
    const std::array<double, 3> p = run.solid->centre(i);
    result[{static_cast<int>(std::floor(p[0] / dx)), static_cast<int>(std::floor(p[1] / dx)),
            static_cast<int>(std::floor(p[2] / dx))}] = i;
  }
  return result;
}

TEST(SolidLabels, TheDefaultHeartThroughALabelMapIsItself) {
  const std::vector<std::string> all = {"lv", "rv", "la", "ra"};
  const Settings set = {{"grid.dx_mm", dx}};
  SolidRun heart(structure(GeometryKind::heart, all), set);
  SolidRun map(labelled(default_heart(), all), set, {{}, {}});
  for (const std::size_t m : {0, 1}) ASSERT_EQ(map.solid->defect(m), "");
  EXPECT_EQ(map.solid->free_motions(0), 0);
  EXPECT_EQ(map.mesh().tissue_cells[0], map.mesh().tissue_cells[1]);
  const std::vector<double> a = volumes(heart), b = volumes(map);
  for (std::size_t q = 0; q < all.size(); ++q) {
    std::printf("%s: %.2f mL, through labels of %g mm %.2f\n", all[q].c_str(), a[q], voxel, b[q]);
    EXPECT_NEAR(b[q] / a[q], 1, 0.003) << all[q];
  }
  // Cell by cell: shares, regions, fibres and wall normals at the points of stress.
  const auto own = cells_of(heart), other = cells_of(map);
  double tissue = 0, apart = 0, same_region = 0, weight = 0;
  std::vector<double> fibres, normals;
  const std::vector<double> f = heart.solid->directions(), g = map.solid->directions();
  for (const auto& [place, i] : own) {
    double share = 0, there = 0;
    for (std::size_t p = 0; p < 4; ++p) share += 0.25 * heart.quarter(i, p);
    tissue += share;
    const auto match = other.find(place);
    if (match == other.end()) {
      apart += share;
      continue;
    }
    const std::size_t j = match->second;
    for (std::size_t p = 0; p < 4; ++p) there += 0.25 * map.quarter(j, p);
    apart += std::abs(there - share);
    const std::string &name = heart.scene.regions[heart.mesh().region[i]].name,
                      &found = map.scene.regions[map.mesh().region[j]].name;
    weight += share;
    same_region += name == found ? share : 0;
    if (name != found || (name != "lv" && name != "rv") || share < 0.5) continue;
    for (std::size_t part = 0; part < 8; ++part) {  // four fibres, four normals
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k)
        dot += f[(3 * part + k) * static_cast<std::size_t>(heart.mesh().cells) + i] *
               g[(3 * part + k) * static_cast<std::size_t>(map.mesh().cells) + j];
      (part < 4 ? fibres : normals)
          .push_back(std::acos(std::min(1.0, std::abs(dot))) * 180 / 3.14159265358979);
    }
  }
  const auto quantile = [](std::vector<double>& x, double share) {
    std::sort(x.begin(), x.end());
    return x[static_cast<std::size_t>(share * static_cast<double>(x.size() - 1))];
  };
  std::printf(
      "shares differ by %.4f of the tissue, regions agree in %.4f; degrees between fibres: median %.2f, 95 "
      "%% below "
      "%.2f; between normals %.2f, %.2f\n",
      apart / tissue, same_region / weight, quantile(fibres, 0.5), quantile(fibres, 0.95),
      quantile(normals, 0.5), quantile(normals, 0.95));
  EXPECT_GT(fibres.size(), 1000u);
  EXPECT_LT(apart / tissue, 0.03);
  EXPECT_GT(same_region / weight, 0.995);
  EXPECT_LT(quantile(fibres, 0.5), 3);
  EXPECT_LT(quantile(fibres, 0.95), 10);
  EXPECT_LT(quantile(normals, 0.5), 3);
  EXPECT_LT(quantile(normals, 0.95), 10);
  // Clamps hold the same nodes: those of both bases.
  for (std::size_t k = 0; k < heart.mesh().held.size(); ++k) {
    const double members = 2;
    EXPECT_NEAR(static_cast<double>(map.mesh().held[k].size()) / members,
                static_cast<double>(heart.mesh().held[k].size()),
                0.03 * static_cast<double>(heart.mesh().held[k].size()));
  }
}

// A plane that is lower takes blood and tissue above it away.
TEST(SolidLabels, WallsEndAtTheBase) {
  std::vector<double> found;
  for (const double base : {0.0, -9.0}) {
    SolidRun run(labelled(default_heart(), {"lv", "rv"}), {{"grid.dx_mm", dx}, {"mechanics.base_mm", base}});
    ASSERT_EQ(run.solid->defect(0), "");
    EXPECT_EQ(run.mesh().lid[2], base < 0 ? -8 : 0);  // the next face of the grid
    for (std::size_t i = 0; i < run.mesh().grid_cell.size(); ++i)
      if (run.mesh().grid_cell[i] >= 0) {
        EXPECT_LT(run.solid->centre(i)[2], base < 0 ? -8 : 0);
      }
    found.push_back(volumes(run)[0]);
  }
  // 8 mm of the left ventricle's cavity, an ellipsoid of 25, 25 and 90 (1 - 0.278) mm about z = -25.02.
  const auto above = [](double z) {
    return std::pow(25.0, 2) * (z - std::pow(z, 3) / (3 * std::pow(64.98, 2)));
  };
  const double slab = 3.14159265358979 * (above(25.02) - above(17.02)) / 1000;
  EXPECT_NEAR((found[0] - found[1]) / slab, 1, 0.02);
}

}  // namespace
}  // namespace cohort::test
