// Atria of tissue: their cavities against the geometry's formulas, what pressure in them does, and which
// walls deform with which cavities. How they beat: heart_atria.cpp.
#include <set>

#include "solver/mechanics_structure.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

using Point = std::array<double, 3>;

/// The schematic heart with prescribed pressures in these cavities.
Scene heart(const std::vector<std::string>& cavities, Precision precision = Precision::single_) {
  Scene scene;
  scene.precision = precision;
  Mechanics& mechanics = scene.mechanics.emplace();
  mechanics.quasi_static = true;
  for (const std::string& name : cavities) mechanics.cavities.push_back({name, {}});
  mechanics.boundary = default_heart_boundary(mechanics);
  return scene;
}

/// Volumes of the cavities, mL.
std::vector<double> volumes(const SolidRun& run) {
  const std::vector<double> S = run.solid->state();
  std::vector<double> result;
  for (std::size_t q = 0; q < run.scene.mechanics->cavities.size(); ++q)
    result.push_back(S[Solid::first_volume + q] / 1000);
  return result;
}

double in_ellipsoid(const Point& p, const Point& centre, const Point& radii) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += std::pow((p[k] - centre[k]) / radii[k], 2);
  return sum;
}

/// Volumes of the default heart's atria by their formulas (mL): ellipsoids above the plate, clear of the
/// aorta by a wall, the right one outside the left one's wall. A wall is taken between two ellipsoids of
/// semi-axes that differ by it.
std::array<double, 2> atrial_volumes(double plate) {
  constexpr double a = 25, wall = 2.6, fine = 0.5;
  const Point la_radii = {24, 27, 22}, ra_radii = {24, 29, 25};
  const Point la = {-0.32 * a, -0.4 * a, 4 + 0.77 * la_radii[2]},
              ra = {la[0] + la_radii[0] + ra_radii[0], -0.4 * a, 4 + 0.72 * ra_radii[2]};
  const Point la_outer = {la_radii[0] + wall, la_radii[1] + wall, la_radii[2] + wall};
  const Point root = {0.36 * a, 0.36 * a, 0}, along = {0.0485, 0.2423, 0.9690};
  std::array<double, 2> result{};
  for (double z = plate + 0.5 * fine; z < 60; z += fine)
    for (double y = -45 + 0.5 * fine; y < 25; y += fine)
      for (double x = -40 + 0.5 * fine; x < 75; x += fine) {
        const Point p = {x, y, z};
        double height = 0, square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          height += (p[k] - root[k]) * along[k];
          square += (p[k] - root[k]) * (p[k] - root[k]);
        }
        if (height < 45 && std::sqrt(square - height * height) < 10.5 + 2 + wall) continue;
        if (in_ellipsoid(p, la, la_radii) < 1)
          result[0] += fine * fine * fine / 1000;
        else if (in_ellipsoid(p, ra, ra_radii) < 1 && in_ellipsoid(p, la, la_outer) > 1)
          result[1] += fine * fine * fine / 1000;
      }
  return result;
}

TEST(Atria, HoldWhatTheirFormulasSay) {
  for (const double dx : {4.0, 2.0}) {
    SolidRun run(heart({"la", "ra"}), {{"grid.dx_mm", dx}});
    ASSERT_EQ(run.solid->defect(0), "");
    EXPECT_EQ(run.solid->free_motions(0), 0);
    run.measured(run.at_rest());
    const std::vector<double> found = volumes(run);
    const std::array<double, 2> exact = atrial_volumes(4);
    std::printf("%g mm: la %.2f mL, formula %.2f; ra %.2f, %.2f\n", dx, found[0], exact[0], found[1],
                exact[1]);
    for (std::size_t q = 0; q < 2; ++q) EXPECT_NEAR(found[q] / exact[q], 1, 0.003);
  }
}

// Which walls there are follows from the cavities, in any order and number.
TEST(Atria, WallsThatDeformAreThoseOfTheCavities) {
  using Names = std::set<std::string>;
  const std::vector<std::pair<std::vector<std::string>, Names>> cases = {
      {{"lv", "rv", "la", "ra"}, {"lv", "rv", "la", "ra", "bachmann"}},
      {{"ra", "lv"}, {"lv", "rv", "ra"}},
      {{"la"}, {"la"}},
      {{"ra"}, {"ra"}}};
  std::map<std::string, double> volume;  // of each cavity, in the first case
  for (const auto& [cavities, walls] : cases) {
    Settings set = {{"grid.dx_mm", 4}};
    SolidRun run(heart(cavities), set);
    ASSERT_EQ(run.solid->defect(0), "") << cavities[0];
    EXPECT_EQ(run.solid->free_motions(0), 0);
    Names found;
    for (std::size_t i = 0; i < run.mesh().grid_cell.size(); ++i)
      if (run.mesh().grid_cell[i] >= 0) found.insert(run.scene.regions[run.mesh().region[i]].name);
    EXPECT_EQ(found, walls);
    run.measured(run.at_rest());
    const std::vector<double> own = volumes(run);
    for (std::size_t q = 0; q < cavities.size(); ++q) {
      const auto [first, is_new] = volume.emplace(cavities[q], own[q]);
      // A right atrium by itself has the whole wall that it shares with the left one otherwise.
      const bool alone = cavities[q] == "ra" && !walls.contains("la");
      if (is_new) continue;
      EXPECT_NEAR(own[q] / first->second, 1, alone ? 0.03 : 1e-6) << cavities[q];
    }
  }
}

// The pressure of each of four cavities pulls with the slope of its own volume, for motions that leave lids
// in their planes.
TEST(Atria, PressuresForcesAreTheVolumesSlope) {
  const std::vector<std::string> names = {"lv", "rv", "la", "ra"};
  Scene scene = heart(names, Precision::double_);
  scene.mechanics->boundary.clear();  // supports resist too
  SolidRun run(scene, {{"grid.dx_mm", 6}});
  ASSERT_EQ(run.solid->defect(0), "");
  std::vector<double> motion = run.random_field(0.3, 1), step = run.random_field(1, 2);
  const double plate = run.mesh().lid[6 * 2 + 2];
  EXPECT_EQ(plate, 6);  // at least a cell above the ventricles
  for (std::size_t a = 0; a < run.nodes(); ++a)
    if (std::abs(run.place(a)[2]) < 1e-9 || std::abs(run.place(a)[2] - plate) < 1e-9)
      motion[2 * run.nodes() + a] = step[2 * run.nodes() + a] = 0;
  const auto moved = [&](double by) {
    std::vector<double> u = motion;
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += by * step[i];
    run.measured(u);
    return volumes(run);
  };
  constexpr double e = 1e-4;
  const std::vector<double> low = moved(-e), high = moved(e);
  for (std::size_t q = 0; q < names.size(); ++q) {
    std::vector<double> pressures(names.size(), 0), g = run.forces(motion);
    for (double& x : g) x = -x;
    pressures[q] = 1;
    const std::vector<double> with = run.forces(motion, pressures);
    for (std::size_t i = 0; i < g.size(); ++i) g[i] += with[i];
    const double slope = 1000 * (high[q] - low[q]) / (2 * e);
    std::printf("%s: slope %.6g mm3, pressure's work %.6g\n", names[q].c_str(), slope, dot(g, step));
    EXPECT_GT(std::abs(slope), 1) << names[q];
    EXPECT_NEAR(dot(g, step) / slope, 1, 1e-6) << names[q];
  }
}

}  // namespace
}  // namespace cohort::test
