// Cavities of the deforming tissue: their volumes, what pressure in them does, and that members of a batch do
// not feel each other.
#include <numbers>

#include "tests/laws.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

using std::numbers::pi;

Settings base_at(double z) {
  return {{"geometry.shapes.below_base.half_space.point_mm.z", z}};
}
Settings both(Settings a, const Settings& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Derivative of the cavity's volume by the places of the nodes: what 1 kPa in it does.
std::vector<double> volume_slope(SolidRun& run, const std::vector<double>& u) {
  std::vector<double> with = run.forces(u, {1});
  const std::vector<double> without = run.forces(u);
  for (std::size_t i = 0; i < with.size(); ++i) with[i] -= without[i];
  return with;
}

// An ellipsoid's volume converges, and pressure in a closed cavity neither pushes nor turns the tissue.
TEST(SolidCavity, VolumeOfAnEllipsoidConverges) {
  const std::array<double, 3> axes = {9, 7, 8}, centre = {0.3, -0.2, 0.4};
  const double exact = 4 * pi / 3 * axes[0] * axes[1] * axes[2];
  std::vector<double> errors;
  for (const double dx : {2.0, 1.0, 0.5}) {
    SolidRun run(hollow(false, "neo_hookean", Precision::double_, false), ellipsoids(axes, 3, dx, centre));
    ASSERT_EQ(run.solid->defect(0), "");
    const double volume = run.measured(run.at_rest()).volume_mm3;
    errors.push_back(volume / exact - 1);
    // Also in a deformed state: an affine map scales the volume by its determinant, to rounding.
    const Matrix F = {{{1.1, 0.1, -0.2}, {0.05, 0.9, 0.15}, {-0.1, 0.2, 1.2}}};
    const std::vector<double> u = run.field([&](const Vector& X) {
      const Vector x = times(F, X);
      return Vector{x[0] - X[0] + 5, x[1] - X[1] - 3, x[2] - X[2] + 1};
    });
    EXPECT_NEAR(run.measured(u).volume_mm3 / (determinant(F) * volume), 1, 1e-12);
    for (const std::vector<double>& motion : {run.at_rest(), u, run.random_field(0.2 * dx, 3)}) {
      const std::vector<double> g = volume_slope(run, motion);
      std::array<double, 3> force{}, torque{};
      double size = 0;
      for (std::size_t a = 0; a < run.nodes(); ++a) {
        Vector f, x = run.place(a);
        for (std::size_t k = 0; k < 3; ++k) {
          f[k] = g[k * run.nodes() + a];
          x[k] += motion[k * run.nodes() + a];
          force[k] += f[k];
          size += std::abs(f[k]);
        }
        for (std::size_t k = 0; k < 3; ++k)
          torque[k] += x[(k + 1) % 3] * f[(k + 2) % 3] - x[(k + 2) % 3] * f[(k + 1) % 3];
      }
      EXPECT_GT(size, 100);
      for (const double sum : force) EXPECT_LT(std::abs(sum) / size, 1e-13);
      for (const double sum : torque) EXPECT_LT(std::abs(sum) / size, 1e-11);
    }
  }
  std::printf("closed ellipsoid: error of the volume %.4f, %.4f, %.4f %% at 2, 1, 0.5 mm\n", 100 * errors[0],
              100 * errors[1], 100 * errors[2]);
  // Of first order, and small: what a cell holds of the other side is neglected below 5 %.
  EXPECT_LT(std::abs(errors[0]), 3e-3);
  EXPECT_LT(std::abs(errors[1]), 0.65 * std::abs(errors[0]));
  EXPECT_LT(std::abs(errors[2]), 0.65 * std::abs(errors[1]));
}

// Cells and items lie in compact tiles, which share few nodes: of 128 cubes in a cube of 5 x 5 x 5 there
// are 1.7 nodes a cube, of 128 in a layer 2.2.
TEST(SolidCavity, TilesAreCompact) {
  SolidRun run(hollow(true, "neo_hookean", Precision::double_, false),
               both(ellipsoids({14, 14, 34}, 6, 1), base_at(0)));
  ASSERT_EQ(run.solid->defect(0), "");
  const SolidMesh& mesh = run.mesh();
  const auto used = [](const std::vector<int>& of) {
    return static_cast<double>(std::count_if(of.begin(), of.end(), [](int i) { return i >= 0; }));
  };
  const double cells = used(mesh.grid_cell), items = used(mesh.item_cell);
  const double of_cells = static_cast<double>(mesh.slot_node.size()) / cells,
               of_items = static_cast<double>(mesh.item_slot_node.size()) / items;
  std::printf("%.0f cells, %.0f items: %.2f and %.2f slots each, %d in a tile\n", cells, items, of_cells,
              of_items, mesh.most_slots);
  EXPECT_GT(items, 8 * SolidMesh::block);
  EXPECT_LT(of_cells, 2.2);
  EXPECT_LT(of_items, 3);
  EXPECT_LT(mesh.most_slots, 3.3 * SolidMesh::block);
}

// A ventricle cut open at z = 0: half of an ellipsoid, closed by its lid.
TEST(SolidCavity, AnOpenCavityEndsAtItsLid) {
  const std::array<double, 3> axes = {7, 7, 17};
  const double exact = 2 * pi / 3 * axes[0] * axes[1] * axes[2];
  SolidRun run(hollow(true, "neo_hookean", Precision::double_, false),
               both(ellipsoids(axes, 3, 1), base_at(0)));
  ASSERT_EQ(run.solid->defect(0), "");
  const double volume = run.measured(run.at_rest()).volume_mm3;
  EXPECT_NEAR(volume / exact, 1, 2e-3);
  // Its plane may move, and what moves it in itself changes nothing.
  const Matrix F = {{{1.1, 0.1, -0.2}, {0.05, 0.9, 0.15}, {0, 0, 1.2}}};
  const std::vector<double> u = run.field([&](const Vector& X) {
    const Vector x = times(F, X);
    return Vector{x[0] - X[0] + 5, x[1] - X[1] - 3, x[2] - X[2] + 4};
  });
  EXPECT_NEAR(run.measured(u).volume_mm3 / (determinant(F) * volume), 1, 1e-12);
  // Pressure on the wall pushes it down by the lid's area, but for the blood in cells of the rim, which
  // presses on its cell's part of the lid.
  double of_cells = 0;
  for (std::size_t j = 0; j < run.mesh().item_cell.size(); ++j) {
    if (run.mesh().item_cell[j] < 0) continue;
    if (std::abs(run.solid->centre(static_cast<std::size_t>(run.mesh().item_cell[j]))[2] + 0.5) > 1e-9)
      continue;
    for (std::size_t g = 0; g < 4; ++g) of_cells += 0.25 * run.mesh().item_share[SolidMesh::in_tile(j, g, 4)];
  }
  const std::vector<double> g = volume_slope(run, run.at_rest());
  double push = 0;
  for (std::size_t a = 0; a < run.nodes(); ++a) push += g[2 * run.nodes() + a];
  EXPECT_GT(of_cells, 0.1 * pi * axes[0] * axes[1]);
  EXPECT_NEAR((of_cells - push) / (pi * axes[0] * axes[1]), 1, 5e-3);
  // A rim that moves across its plane takes the lid with it: the volume grows by what the wall sweeps and the
  // lid.
  std::vector<double> moved[2] = {run.at_rest(), run.at_rest()}, rim = run.at_rest();
  for (std::size_t a = 0; a < run.nodes(); ++a) {
    if (!run.is_node(a) || std::abs(run.place(a)[2]) > 1e-9) continue;
    rim[2 * run.nodes() + a] = 1;
    moved[0][2 * run.nodes() + a] = -1e-4;
    moved[1][2 * run.nodes() + a] = 1e-4;
  }
  const double rise = (run.measured(moved[1]).volume_mm3 - run.measured(moved[0]).volume_mm3) / 2e-4;
  EXPECT_NEAR(rise / (dot(g, rim) - push), 1, 1e-7);
}

// The pressure's forces are the slope of the volume: for motions that leave the lid in its plane.
TEST(SolidCavity, PressuresForcesAreTheVolumesSlope) {
  for (const bool open : {false, true}) {
    SolidRun run(
        hollow(open, "neo_hookean", Precision::double_, false),
        both(ellipsoids({7, 7, 12}, 3, 1, {0, 0, open ? 0.0 : 0.3}), open ? base_at(0) : Settings{}));
    double worst = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
      std::vector<double> u = run.random_field(0.15, seed), w = run.random_field(1, seed + 10);
      for (std::size_t a = 0; open && a < run.nodes(); ++a)
        if (std::abs(run.place(a)[2]) < 1e-9) u[2 * run.nodes() + a] = w[2 * run.nodes() + a] = 0;
      const double expected = dot(volume_slope(run, u), w), step = 1e-5;
      const auto volume = [&](double along) {
        std::vector<double> moved = u;
        for (std::size_t i = 0; i < u.size(); ++i) moved[i] += along * w[i];
        return run.measured(moved).volume_mm3;
      };
      const double found = (volume(step) - volume(-step)) / (2 * step);
      EXPECT_GT(std::abs(expected), 1);
      worst = std::max(worst, std::abs(found / expected - 1));
    }
    std::printf("%s cavity: slope of the volume over the pressure's forces differs by %.1e\n",
                open ? "open" : "closed", worst);
    EXPECT_LT(worst, 1e-7);
  }
}

// Tissue under the pressure of its blood is in balance at the cavity's wall, cut cells too, in any state that
// the law takes for a change of volume alone: each quarter's tissue and blood push as a whole one does.
TEST(SolidCavity, BloodAndTissueOfOnePressureAreInBalance) {
  using K = Shape::Kind;
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.precision = Precision::double_;
  scene.shapes = {{"outer", K::box, {}}, {"inner", K::box, {}}, {"wall", K::subtract, {"outer", "inner"}}};
  scene.regions = {{.name = "wall", .shape = "wall"}};
  scene.mechanics =
      Mechanics{.law = "neo_hookean", .tension = {}, .cavities = {{"hole", "inner"}}, .boundary = {}};
  Settings set = {{"grid.dx_mm", 1}};
  for (const char* axis : {"x", "y", "z"}) {
    set.emplace_back(std::string("geometry.shapes.outer.box.size_mm.") + axis, 16);
    set.emplace_back(std::string("geometry.shapes.inner.box.size_mm.") + axis,
                     6.5);  // blood: 1/4 of the last cells
    set.emplace_back(std::string("geometry.shapes.inner.box.centre_mm.") + axis, 0);
    set.emplace_back(std::string("geometry.shapes.outer.box.centre_mm.") + axis, 0);
  }
  SolidRun run(std::move(scene), set);
  ASSERT_EQ(run.solid->defect(0), "");
  std::mt19937_64 random(5);
  const Matrix R = random_rotation(random);
  constexpr double stretch = 0.97;
  const double kappa = run.scene.parameters.value("mechanics.bulk_modulus_kPa");
  const double pressure = kappa * (1 - std::pow(stretch, 3));
  const std::vector<double> f = run.forces(run.field([&](const Vector& X) {
    Vector u = times(R, X);
    for (std::size_t k = 0; k < 3; ++k) u[k] = stretch * u[k] - X[k];
    return u;
  }),
                                           {pressure});
  double at_wall = 0;
  int cut = 0;
  for (std::size_t a = 0; a < run.nodes(); ++a) {
    if (!run.is_node(a)) continue;
    const Vector X = run.place(a);
    if (std::max({std::abs(X[0]), std::abs(X[1]), std::abs(X[2])}) > 6) continue;
    for (const std::size_t cell : run.cells_of(a))
      for (std::size_t g = 0; g < 4; ++g) {
        ASSERT_GE(run.quarter(cell, g), SolidMesh::mass_floor);
        cut += run.quarter(cell, g) < 1;
      }
    for (std::size_t k = 0; k < 3; ++k) at_wall = std::max(at_wall, std::abs(f[k * run.nodes() + a]));
  }
  EXPECT_GT(cut, 1000);
  EXPECT_GT(largest_of(f), 0.1 * pressure);  // at the free surface outside
  EXPECT_LT(at_wall / largest_of(f), 1e-13);
}

// Of three members with their own walls, pressures and laws, each moves as it does alone, bit for bit.
TEST(SolidBatch, MembersMoveAsAlone) {
  const auto settings = [](double wall, double pressure, double C) {
    return Settings{{"geometry.shapes.inner.ellipsoid.semi_axes_mm.x", 10 - wall},
                    {"mechanics.cavities.lv.pressure_kPa", pressure},
                    {"mechanics.guccione.C_kPa", C}};
  };
  const std::vector<Settings> all = {settings(3, 2, 2), settings(4, 0.5, 5), settings(3.5, 1, 0.8)};
  const Settings common = both(ellipsoids({7, 7, 12}, 3, 1), base_at(0));
  for (const Precision precision : {Precision::single_, Precision::double_}) {
    const auto moved = [&](const std::vector<Settings>& members) {
      auto run = std::make_unique<SolidRun>(hollow(true, "guccione", precision, true), common, members);
      for (int step = 0; step < 200; ++step) run->loaded_step(step % 16 == 0);
      return run;
    };
    const auto together = moved(all);
    const std::vector<double> u = together->solid->displacement(), S = together->solid->state();
    for (std::size_t m = 0; m < all.size(); ++m) {
      const auto alone = moved({all[m]});
      const std::vector<double> own = alone->solid->displacement(), state = alone->solid->state();
      const auto first = static_cast<std::size_t>(together->mesh().node_blocks[m]) * SolidMesh::block;
      const std::size_t count = alone->nodes() - SolidMesh::block;
      ASSERT_EQ(count,
                static_cast<std::size_t>(together->mesh().node_blocks[m + 1]) * SolidMesh::block - first);
      EXPECT_GT(largest_of(own), 0.05);
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t a = 0; a < count; ++a)
          ASSERT_EQ(u[k * together->nodes() + first + a], own[k * alone->nodes() + SolidMesh::block + a]);
      for (std::size_t k = 0; k < Solid::state_size; ++k)
        ASSERT_EQ(S[m * Solid::state_size + k], state[k]) << k;
    }
  }
}

}  // namespace
}  // namespace cohort::test
