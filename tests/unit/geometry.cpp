// Signed distances, set algebra, shapes and boxes against exact distances and volumes.
#include "tests/geometry_run.hpp"

namespace cohort::test {
namespace {

using std::numbers::pi;
using Kind = Shape::Kind;

struct Distance {
  std::string expression;
  Point at;
  double exact;
};

TEST(SignedDistance, PrimitivesAreExact) {
  const double s2 = std::sqrt(2.0);
  const std::string z = "(real3)(0, 0, 1)",
                    cone = "sd_cone(p, (real3)(0, 0, 1), 5, 2, 4)";  // side 3 in, 4 up: 3-4-5
  const std::vector<Distance> cases = {
      {"sd_half_space(p, (real3)(1, 0, 0), (real3)(1, 0, 0))", {3, 7, -2}, 2},
      {"sd_box(p, (real3)(1, 2, 3))", {0, 0, 0}, -1},
      {"sd_box(p, (real3)(1, 2, 3))", {0.5, 1.75, 0}, -0.25},
      {"sd_box(p, (real3)(1, 2, 3))", {4, 6, 3}, 5},  // edge, 3-4-5
      {"sd_box(p, (real3)(1, 2, 3))", {3, 4, 4}, 3},  // corner, 2-2-1
      {"sd_ellipsoid(p, (real3)(5, 5, 5))", {0, 3, 4}, 0},
      {"sd_ellipsoid(p, (real3)(5, 5, 5))", {0, 6, 8}, 5},  // exact for a sphere
      {"sd_ellipsoid(p, (real3)(5, 5, 5))", {1, 0, 0}, -4},
      {"sd_ellipsoid(p, (real3)(2, 3, 4))", {2, 0, 0}, 0},
      {"sd_ellipsoid(p, (real3)(2, 3, 4))", {0, 0, 0}, -2},
      {"sd_ellipsoid(p, (real3)(2, 3, 4))", {0, 3 / s2, 4 / s2}, 0},
      {"sd_capsule(p, (real3)(0, 0, 0), (real3)(0, 0, 10), 2)", {3, 4, 5}, 3},
      {"sd_capsule(p, (real3)(0, 0, 0), (real3)(0, 0, 10), 2)", {0, 3, 14}, 3},
      {"sd_capsule(p, (real3)(1, 1, 1), (real3)(1, 1, 1), 2)", {1, 1, 6}, 3},  // a sphere
      {"sd_cylinder(p, " + z + ", 2, 6)", {5, 0, 7}, 5},
      {"sd_cylinder(p, " + z + ", 2, 6)", {0, 1.5, 1}, -0.5},
      {"sd_cylinder(p, (real3)(1, 0, 0), 2, 6)", {0, 0, 5}, 3},
      {cone, {0, 0, 3}, 1},            // above the upper end
      {cone, {5, 0, -4}, 2},           // below the edge of the lower end
      {cone, {3.5 + 0.8, 0, 0.6}, 1},  // off the middle of the side, along its normal (0.8, 0.6)
      {cone, {0, 3.5 - 0.8, -0.6}, -1},
  };
  for (const Distance& c : cases)
    EXPECT_NEAR(distances(c.expression, {c.at})[0], c.exact, 2e-6)
        << c.expression << " at " << c.at[0] << " " << c.at[1] << " " << c.at[2];
}

TEST(SignedDistance, SetAlgebraIsThatOfSets) {
  const std::string a = "sd_ellipsoid(p, (real3)(5, 5, 5))",
                    b = "sd_box(p - (real3)(4, 0, 0), (real3)(3, 2, 2))";
  std::vector<Point> points;
  for (int i = 0; i < 1000; ++i)
    points.push_back({-8 + 1.7 * (i % 10), -6 + 1.3 * (i / 10 % 10), -6 + 1.3 * (i / 100)});
  const auto in_a = distances(a, points), in_b = distances(b, points);
  const auto both = distances("sd_intersection(" + a + ", " + b + ")", points),
             any = distances("sd_union(" + a + ", " + b + ")", points);
  const auto only = distances("sd_subtract(" + a + ", " + b + ")", points),
             wall = distances("sd_shell(" + a + ", 2)", points);
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(any[i] < 0, in_a[i] < 0 || in_b[i] < 0);
    EXPECT_EQ(both[i] < 0, in_a[i] < 0 && in_b[i] < 0);
    EXPECT_EQ(only[i] < 0, in_a[i] < 0 && in_b[i] > 0);
    const double radius = std::hypot(points[i][0], points[i][1], points[i][2]);
    EXPECT_EQ(wall[i]<0, radius> 4 && radius < 6);
  }
}

// Wedges of 40, 90 and 150 degrees between half-spaces a <= 0 and b <= 0 with the edge along z: against the
// nearest of both faces, each ended by the edge.
TEST(SignedDistance, IntersectionsHaveEdges) {
  std::vector<Point> points;
  for (int i = 0; i < 400; ++i) points.push_back({-5 + 0.53 * (i % 20), -5 + 0.51 * (i / 20), 0.3});
  for (const double wedge : {40.0, 90.0, 150.0}) {
    const double turn = std::numbers::pi - wedge * std::numbers::pi / 180;  // between the outward normals
    const double nx = std::cos(turn), ny = std::sin(turn);
    const std::string c = std::to_string(nx), s = std::to_string(ny);
    const auto d =
        distances("sd_intersection_edge(p.x, " + c + "f * p.x + " + s + "f * p.y, " + c + "f)", points);
    for (size_t i = 0; i < points.size(); ++i) {
      const double x = points[i][0], y = points[i][1], a = x, b = nx * x + ny * y;
      double exact;
      if (a <= 0 && b <= 0) {
        exact = std::max(a, b);
      } else {
        // Along each face, away from the edge.
        const double along_a = std::min(0.0, y), along_b = std::max(0.0, -ny * x + nx * y);
        exact = std::min(std::hypot(x, y - along_a), std::hypot(x + ny * along_b, y - nx * along_b));
      }
      EXPECT_NEAR(d[i], exact, 1e-4) << wedge << " degrees at " << x << " " << y;
    }
  }
}

TEST(SignedDistance, SmoothUnionBlendsOverItsLength) {
  const auto at = [](const std::string& values) {
    return distances("sd_smooth_union(" + values + ") + 0 * p.x", {{0, 0, 0}})[0];
  };
  EXPECT_FLOAT_EQ(at("3, 3, 8"), 1.0f);  // equal distances: down by k/4
  EXPECT_FLOAT_EQ(at("1, 5, 8"), 0.5f);  // h = 1/2: down by k/16
  EXPECT_FLOAT_EQ(at("1, 9, 8"), 1.0f);  // k apart: the minimum
  EXPECT_FLOAT_EQ(at("5, 1, 8"), 0.5f);
  EXPECT_FLOAT_EQ(at("2, 3, 0"), 2.0f);
}

Scene shapes(std::vector<Shape> list, std::vector<Region> regions) {
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.shapes = std::move(list);
  scene.regions = std::move(regions);
  declare_geometry(scene);
  return scene;
}

std::vector<double> with(const Scene& scene, const std::vector<std::pair<std::string, double>>& sizes) {
  std::vector<double> values = scene.parameters.values();
  for (const auto& [path, value] : sizes)
    values[size_t(scene.parameters.index("geometry.shapes." + path))] = value;
  return values;
}

// Volumes in mL at 0.25 mm, centres off the grid: 1e-3 relative, the smooth bodies' own error there.
TEST(Shapes, VolumesOfPrimitivesAreExact) {
  const auto volume = [](Kind kind, const std::string& name,
                         std::vector<std::pair<std::string, double>> sizes) {
    const Scene scene = shapes({{"a", kind, {}}}, {{.name = "tissue", .shape = "a"}});
    for (auto& size : sizes) size.first = "a." + name + "." + size.first;
    return sample(scene, with(scene, sizes), 0.25).volume_mL(0);
  };
  EXPECT_NEAR(volume(Kind::box, "box", {{"size_mm.x", 7.1}, {"size_mm.y", 3.3}, {"centre_mm.x", 0.07}}),
              7.1 * 3.3 * 10 / 1000, 0.01 * 0.2343);
  EXPECT_NEAR(volume(Kind::ellipsoid, "ellipsoid",
                     {{"semi_axes_mm.x", 4}, {"semi_axes_mm.y", 6}, {"centre_mm.z", 0.1}}),
              4. / 3 * pi * 0.24, 1e-3 * 1.005);
  EXPECT_NEAR(volume(Kind::cylinder, "cylinder", {{"radius_mm", 4}, {"axis.x", 0.6}, {"axis.z", 0.8}}),
              pi * 0.16, 2e-3 * 0.5027);
  EXPECT_NEAR(volume(Kind::cone, "cone", {{"axis.y", 0.3}}), pi * 10 / 3 * (25 + 10 + 4) / 1000,
              2e-3 * 0.408);
  EXPECT_NEAR(volume(Kind::capsule, "capsule", {{"to_mm.x", 5}}),
              (pi * 25 * std::sqrt(125.) + 4. / 3 * pi * 125) / 1000, 1e-3 * 1.4);
}

// Wall of a sphere, 1.4 mm thick, on grids coarser and finer than the wall.
TEST(Shapes, VolumeOfAShellConvergesWithSecondOrder) {
  const Scene scene = shapes({{"ball", Kind::ellipsoid, {}}, {"wall", Kind::shell, {"ball"}}},
                             {{.name = "tissue", .shape = "wall"}});
  const std::vector<double> values = with(scene, {{"wall.shell.thickness_mm", 1.4},
                                                  {"ball.ellipsoid.centre_mm.x", 0.13},
                                                  {"ball.ellipsoid.centre_mm.y", 0.29}});
  const double exact = 4. / 3 * pi * (std::pow(10.7, 3) - std::pow(9.3, 3)) / 1000;
  const auto error = [&](double dx) { return std::abs(sample(scene, values, dx).volume_mL(0) / exact - 1); };
  EXPECT_LT(error(2), 0.02);
  EXPECT_LT(error(1), 0.005);
  EXPECT_LT(error(0.5), 0.00125);
  EXPECT_LT(error(0.25), 0.0004);
}

TEST(Shapes, RegionsThatMeetLeaveNoGapAndRegionsThatOverlapCountOnce) {
  const Scene scene = shapes({{"left", Kind::box, {}},
                              {"right", Kind::box, {}},
                              {"ball", Kind::ellipsoid, {}},
                              {"scar", Kind::intersection, {"ball", "right"}}},
                             {{.name = "scar", .shape = "scar", .excitable = false},
                              {.name = "left", .shape = "left"},
                              {.name = "right", .shape = "right"}});
  // Boxes of 10 mm meet at x = 5.5, in the middle of cells; the ball reaches out of the right one.
  const std::vector<double> values = with(scene, {{"left.box.centre_mm.x", 0.5},
                                                  {"right.box.centre_mm.x", 10.5},
                                                  {"ball.ellipsoid.centre_mm.x", 15.5},
                                                  {"ball.ellipsoid.semi_axes_mm.x", 4},
                                                  {"ball.ellipsoid.semi_axes_mm.y", 4},
                                                  {"ball.ellipsoid.semi_axes_mm.z", 4}});
  const Cells cells = sample(scene, values, 1);
  EXPECT_NEAR(cells.volume_mL(0) + cells.volume_mL(1) + cells.volume_mL(2), 2, 1e-4);
  EXPECT_NEAR(cells.volume_mL(0), 2. / 3 * pi * 0.064, 0.03 * 0.134);
  for (size_t i = 0; i < cells.size(); ++i) {
    const Point p = cells.centre(i);
    if (p[0] > -4 && p[0] < 15 && std::abs(p[1]) < 5 && std::abs(p[2]) < 5) {
      ASSERT_FLOAT_EQ(cells.fraction[i], 1) << p[0];
    }
  }
}

TEST(Shapes, TransmuralFibresTurnFromInnerToOuterSurface) {
  const Scene scene = shapes(
      {{"outer", Kind::ellipsoid, {}},
       {"inner", Kind::ellipsoid, {}},
       {"below", Kind::half_space, {}},
       {"wall", Kind::subtract, {"outer", "inner"}},
       {"ventricle", Kind::intersection, {"wall", "below"}}},
      {{.name = "tissue", .shape = "ventricle", .excitable = true, .fibres = Region::Fibres::transmural}});
  const std::vector<double> values = with(scene, {{"inner.ellipsoid.semi_axes_mm.x", 5},
                                                  {"inner.ellipsoid.semi_axes_mm.y", 5},
                                                  {"inner.ellipsoid.semi_axes_mm.z", 5}});
  const Extent extent = geometry_extent(scene, values);
  EXPECT_EQ(extent.upper[2], 0);
  EXPECT_EQ(extent.lower[2], -10);
  const Cells cells = sample(scene, values, 0.5);
  int tested = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const Point p = cells.centre(i);
    const double radius = std::hypot(p[0], p[1], p[2]), u = (radius - 5) / 5;
    if (u < 0 || u > 1 || p[2] > 0 || p[2] < -2) continue;
    const auto& f = cells.fibre[i].s;
    EXPECT_NEAR(std::hypot(f[0], f[1], f[2]), 1, 1e-5);
    EXPECT_NEAR((f[0] * p[0] + f[1] * p[1] + f[2] * p[2]) / radius, 0, 2e-3);
    const double around = (-p[1] * double(f[0]) + p[0] * double(f[1])) / std::hypot(p[0], p[1]);
    const double angle = std::copysign(std::acos(std::clamp(around, -1.0, 1.0)), double(f[2])) * 180 / pi;
    EXPECT_NEAR(angle, 60 - 120 * u, 0.6);
    EXPECT_NEAR(cells.coordinates[i].s[0], u, 1e-4);
    ++tested;
  }
  EXPECT_GT(tested, 1000);
}

TEST(Shapes, MistakesAreNamed) {
  const auto message = [](std::vector<Shape> list, std::vector<Region> regions) -> std::string {
    try {
      const Scene scene = shapes(std::move(list), std::move(regions));
      geometry_extent(scene, scene.parameters.values());
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message({{"a", Kind::union_, {"b", "c"}}}, {}),
            "shape \"a\" uses shape \"b\", which is not defined before it");
  EXPECT_EQ(message({{"a", Kind::box, {}}, {"a", Kind::box, {}}}, {}), "shape \"a\" is named twice");
  EXPECT_EQ(message({{"a", Kind::box, {}}}, {{.name = "r", .shape = "b"}}),
            "region \"r\" is filled by shape \"b\", which does not exist");
  EXPECT_EQ(message({{"a", Kind::half_space, {}}}, {{.name = "r", .shape = "a"}}),
            "geometry.regions.r has no bounds: nothing cuts its half-space");
  EXPECT_EQ(
      message({{"a", Kind::box, {}}},
              {{.name = "r", .shape = "a", .excitable = true, .fibres = Region::Fibres::transmural}}),
      "geometry.regions.r has transmural fibres, but shape \"a\" is no wall: a shell, or a subtract of the "
      "inner from the outer surface");
}

TEST(Box, FillsWhatItsSizesSay) {
  Scene scene;
  scene.geometry = GeometryKind::box;
  declare_geometry(scene);
  std::vector<double> values = scene.parameters.values();
  values[size_t(scene.parameters.index("geometry.box.size_mm.x"))] = 20.3;
  values[size_t(scene.parameters.index("geometry.fibres.direction.y"))] = 1;
  const Cells cells = sample(scene, values, 1);
  EXPECT_NEAR(cells.volume_mL(0), 20.3 * 7 * 3 / 1000, 1e-6);
  for (size_t i = 0; i < cells.size(); ++i)
    if (cells.region[i] == 0) {
      ASSERT_FLOAT_EQ(cells.fibre[i].s[0], float(std::sqrt(0.5)));
      ASSERT_FLOAT_EQ(cells.fibre[i].s[1], float(std::sqrt(0.5)));
    }
  EXPECT_THROW(site(scene, "sinoatrial_node", values), std::invalid_argument);
}

TEST(ParameterBlock, MacrosNameThePlaces) {
  ParameterTable table;
  table.add({"a.b_mm", "mm", 1, 0, 2, "", ""});
  table.add({"c.d-e.f", "mm", 1, 0, 2, "", ""});
  EXPECT_EQ(parameter_macros(table), "#define PARAM_a_b_mm 0\n#define PARAM_c_d_e_f 1\n");
  table.add({"a.b.mm", "mm", 1, 0, 2, "", ""});
  EXPECT_THROW(parameter_macros(table), std::invalid_argument);
}

}  // namespace
}  // namespace cohort::test
