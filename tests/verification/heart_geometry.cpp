// The schematic heart: masses, volumes, electrical isolation of atria and ventricles, fibres, stimulus sites.
#include "tests/geometry_run.hpp"

namespace cohort::test {
namespace {

constexpr int lv = 0, rv = 1, la = 2, ra = 3, path = 4, bachmann = 5, insulator = 6;
constexpr double density_g_per_mL = 1.06;

bool excitable(int region) {
  return region >= 0 && region < insulator;
}
bool ventricular(int region) {
  return region == lv || region == rv;
}
bool atrial(int region) {
  return region == la || region == ra || region == bachmann;
}

Scene heart() {
  Scene scene;
  scene.geometry = GeometryKind::heart;
  declare_geometry(scene);
  return scene;
}

void set(const Scene& scene, std::vector<double>& values, const std::string& name, double value) {
  values[size_t(scene.parameters.index("geometry.heart." + name))] = value;
}

/// All excitable cells hang together through faces; without the conduction path, no part holds atria and
/// ventricles. (Where the path fills the atrium's rim at 4 mm, taking it away may leave cells on either
/// side.)
void expect_isolated(const Cells& cells) {
  int parts = 0, joined = 0;
  components(cells, excitable, joined);
  EXPECT_EQ(joined, 1);
  const std::vector<int> apart = components(
      cells, [](int r) { return excitable(r) && r != path; }, parts);
  std::vector<size_t> atria, ventricles;  // cells of each part
  atria.resize(size_t(parts));
  ventricles.resize(size_t(parts));
  for (size_t i = 0; i < cells.size(); ++i) {
    if (apart[i] < 0) continue;
    atria[size_t(apart[i])] += atrial(cells.region[i]);
    ventricles[size_t(apart[i])] += ventricular(cells.region[i]);
  }
  for (size_t part = 0; part < size_t(parts); ++part)
    EXPECT_TRUE(atria[part] == 0 || ventricles[part] == 0)
        << atria[part] << " atrial cells meet " << ventricles[part];
  const auto largest = [](const std::vector<size_t>& sizes) {
    return *std::max_element(sizes.begin(), sizes.end());
  };
  const auto all = [](const std::vector<size_t>& sizes) {
    return std::accumulate(sizes.begin(), sizes.end(), size_t(0));
  };
  EXPECT_EQ(largest(ventricles), all(ventricles));
  EXPECT_LE(all(atria) - largest(atria), 2);
}

void expect_inside_grid(const Cells& cells) {
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells.region[i] < 0) continue;
    const int x = int(i % size_t(cells.n[0])), y = int(i / size_t(cells.n[0]) % size_t(cells.n[1]));
    const int z = int(i / (size_t(cells.n[0]) * size_t(cells.n[1])));
    ASSERT_TRUE(x > 0 && y > 0 && z > 0 && x < cells.n[0] - 1 && y < cells.n[1] - 1 && z < cells.n[2] - 1)
        << "region " << cells.region[i] << " at the grid's border, cell " << x << " " << y << " " << z;
  }
}

struct Spacing : testing::TestWithParam<double> {};

// Figures of the heart that gave a normal ECG. This one differs from it on purpose in three places: the edge
// between the right ventricle and its outflow is sharp at the base (-1.6 % of the right ventricle),
// Bachmann's bundle stands out of the atrial walls (+1 g), and the conduction path takes 1 g of the septum.
TEST_P(Spacing, MassesAndCavitiesAreThoseOfTheReference) {
  const Scene scene = heart();
  const Cells cells = sample(scene, scene.parameters.values(), GetParam());
  const auto mass = [&](int region) { return density_g_per_mL * cells.volume_mL(region); };
  EXPECT_NEAR(mass(lv) + 0.7 * mass(path), 143.7, 0.01 * 143.7);
  EXPECT_NEAR(mass(rv), 59.5, 0.025 * 59.5);
  EXPECT_NEAR(mass(la) + mass(ra) + mass(bachmann), 19.6 + 20.8 + 1.0, 0.03 * 40.4);
  EXPECT_NEAR(cells.cavity_mL(0), 132, 0.01 * 132);
  EXPECT_NEAR(cells.cavity_mL(1), 145, 0.02 * 145);
  EXPECT_NEAR(cells.cavity_mL(2), 53, 0.02 * 53);
  EXPECT_NEAR(cells.cavity_mL(3), 68, 0.02 * 68);
}

TEST_P(Spacing, OnlyTheConductionPathJoinsAtriaAndVentricles) {
  const Scene scene = heart();
  const Cells cells = sample(scene, scene.parameters.values(), GetParam());
  expect_isolated(cells);
  expect_inside_grid(cells);
}

TEST_P(Spacing, SitesLieInTheirTissue) {
  const Scene scene = heart();
  const std::vector<double> values = scene.parameters.values();
  const Cells cells = sample(scene, values, GetParam());
  const auto region_at = [&](const std::string& name) {
    const Sphere place = site(scene, name, values);
    std::array<int, 3> cell;
    for (size_t axis = 0; axis < 3; ++axis)
      cell[axis] = int(std::floor((place.centre[axis] - cells.origin[axis]) / cells.dx - 1e-6));
    return cells.region[cells.at(cell[0], cell[1], cell[2])];
  };
  EXPECT_EQ(region_at("sinoatrial_node"), ra);
  EXPECT_EQ(region_at("av_node"), path);
  EXPECT_EQ(region_at("his_bundle"), path);
  EXPECT_THROW(site(scene, "sinus", values), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(Geometry, Spacing, testing::Values(1.0, 2.0, 3.0, 4.0),
                         [](const auto& spacing) { return std::to_string(int(spacing.param)) + "mm"; });

// The default sizes and 16 corners, +-20 % of 15 sizes in a two-level design (columns of a Hadamard matrix).
struct Corner : testing::TestWithParam<int> {};

TEST_P(Corner, EveryRegionIsThereAndIsolated) {
  const Scene scene = heart();
  std::vector<double> values = scene.parameters.values();
  const std::vector<std::vector<std::string>> sizes = {{"lv_radius_mm"},
                                                       {"lv_length_mm"},
                                                       {"lv_wall_mm"},
                                                       {"septum_mm"},
                                                       {"apex_mm"},
                                                       {"rv_width_mm"},
                                                       {"rv_wall_mm"},
                                                       {"rv_outflow_radius_mm"},
                                                       {"atrial_wall_mm"},
                                                       {"av_plate_mm"},
                                                       {"la_radius_mm.x", "la_radius_mm.y", "la_radius_mm.z"},
                                                       {"ra_radius_mm.x", "ra_radius_mm.y", "ra_radius_mm.z"},
                                                       {"aorta_radius_mm"},
                                                       {"pulmonary_artery_radius_mm"},
                                                       {"tricuspid_radius_mm"}};
  if (GetParam() > 0)
    for (unsigned column = 0; column < sizes.size(); ++column) {
      const bool up = std::popcount(unsigned(GetParam() - 1) & (column + 1)) % 2 == 0;
      for (const std::string& name : sizes[column]) {
        const size_t i = size_t(scene.parameters.index("geometry.heart." + name));
        values[i] *= up ? 1.2 : 0.8;
        ASSERT_TRUE(values[i] >= scene.parameters[int(i)].lower &&
                    values[i] <= scene.parameters[int(i)].upper)
            << name;
      }
    }
  for (const double dx : {1.0, 2.0, 3.0, 4.0}) {
    SCOPED_TRACE(dx);
    const Cells cells = sample(scene, values, dx);
    for (size_t r = 0; r < scene.regions.size(); ++r)
      EXPECT_GT(cells.volume_mL(int(r)), 0.5) << scene.regions[r].name;
    for (int c = 0; c < 4; ++c) EXPECT_GT(cells.cavity_mL(c), 20) << "cavity " << c;
    expect_isolated(cells);
    expect_inside_grid(cells);
  }
}

INSTANTIATE_TEST_SUITE_P(Geometry, Corner, testing::Range(0, 17));

TEST(HeartGeometry, ScaleFitsTheBenchmarkBox) {
  const Scene scene = heart();
  std::vector<double> values = scene.parameters.values();
  const double full = sample(scene, values, 2).volume_mL(lv);
  set(scene, values, "scale", 0.93);
  const Extent extent = geometry_extent(scene, values);
  const double room[] = {100, 100, 150};
  for (size_t axis = 0; axis < 3; ++axis) EXPECT_LE(extent.upper[axis] - extent.lower[axis], room[axis] - 2);
  const Cells cells = sample(scene, values, 1);
  EXPECT_NEAR(cells.volume_mL(lv) / full, std::pow(0.93, 3), 0.005);
  expect_isolated(cells);
}

double length(const cl_float4& v) {
  return std::hypot(v.s[0], v.s[1], v.s[2]);
}

TEST(HeartGeometry, FibresAreUnitVectorsWhereTissueConducts) {
  const Scene scene = heart();
  const Cells cells = sample(scene, scene.parameters.values(), 2);
  for (size_t i = 0; i < cells.size(); ++i)
    ASSERT_NEAR(length(cells.fibre[i]), excitable(cells.region[i]) ? 1 : 0, 1e-5)
        << "region " << cells.region[i];
}

// The gradient of u by central differences over cells: 0.5 mm grid, so that it is near the pointwise one, but
// for the seams where distances go over from a face to the edge in which the right ventricle's blood ends:
// u's second derivative jumps.
TEST(HeartGeometry, FibresAreNormalToTheTransmuralGradientAtTheRightAngle) {
  const Scene scene = heart();
  std::vector<double> values = scene.parameters.values();
  set(scene, values, "scale", 0.5);  // 1 mm cells of a heart of half the size are 2 mm cells of the whole
  const Cells cells = sample(scene, values, 0.5);
  const long steps[] = {1, cells.n[0], long(cells.n[0]) * cells.n[1]};
  double largest_cosine = 0, largest_angle_error = 0, seam_cosine = 0, seam_angle_error = 0;
  int endocardial = 0, epicardial = 0, all = 0, bent = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const int region = cells.region[i];
    if (!ventricular(region) || cells.centre(i)[2] > -2 || cells.centre(i)[2] < -30) continue;
    const double u = double(cells.coordinates[i].s[0]);
    if (u < 0.02 || u > 0.98) continue;
    Point g, bend;
    bool inside = true;
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t up = i + size_t(steps[axis]), down = i - size_t(steps[axis]);
      const double above = double(cells.coordinates[up].s[0]), below = double(cells.coordinates[down].s[0]);
      inside = inside && cells.region[up] == region && cells.region[down] == region && above > 0.01 &&
               above < 0.99 && below > 0.01 && below < 0.99;
      g[axis] = above - below;
      bend[axis] = above - 2 * u + below;
    }
    if (!inside) continue;
    const double norm = std::hypot(g[0], g[1], g[2]);
    ++all;
    const bool seam = std::hypot(bend[0], bend[1], bend[2]) > 0.05 * norm;
    if (seam) {
      ++bent;
      EXPECT_EQ(region, rv);
    }
    const auto& f = cells.fibre[i].s;
    double& cosine = seam ? seam_cosine : largest_cosine;
    cosine =
        std::max(cosine, std::abs(double(f[0]) * g[0] + double(f[1]) * g[1] + double(f[2]) * g[2]) / norm);
    // Helix angle: from the direction around z, towards the base.
    const double around = std::hypot(g[0], g[1]);
    const double along = (-g[1] * double(f[0]) + g[0] * double(f[1])) / around;
    const double angle =
        std::copysign(std::acos(std::clamp(along, -1.0, 1.0)), double(f[2])) * 180 / std::numbers::pi;
    double& error = seam ? seam_angle_error : largest_angle_error;
    error = std::max(error, std::abs(angle - (60 - 120 * u)));
    endocardial += u < 0.15;
    epicardial += u > 0.85;
  }
  EXPECT_LT(bent, 0.005 * all);
  EXPECT_LT(seam_cosine, 0.15);
  EXPECT_LT(seam_angle_error, 6);
  EXPECT_GT(endocardial, 1000);
  EXPECT_GT(epicardial, 1000);
  std::printf("%d of %d cells at seams; largest cosine %.3f, angle off by %.2f degrees\n", bent, all,
              largest_cosine, largest_angle_error);
  EXPECT_LT(largest_cosine, 0.05);
  EXPECT_LT(largest_angle_error, 3);
}

TEST(HeartGeometry, CoordinatesRunFromEndocardiumToEpicardiumAndFromApexToBase) {
  const Scene scene = heart();
  const Cells cells = sample(scene, scene.parameters.values(), 1);
  const auto at = [&](double x, double y, double z) {
    return cells.at(int(std::floor(x - cells.origin[0])), int(std::floor(y - cells.origin[1])),
                    int(std::floor(z - cells.origin[2])));
  };
  // Equator, lateral wall: cavity radius 25, wall 9.5.
  const size_t middle = at(-29.5, 0.5, -24.5), inner = at(-25.5, 0.5, -24.5), outer = at(-33.5, 0.5, -24.5);
  EXPECT_NEAR(cells.coordinates[middle].s[0], 4.5 / 9.5, 0.02);
  EXPECT_NEAR(cells.coordinates[inner].s[0], 0.5 / 9.5, 0.02);
  EXPECT_NEAR(cells.coordinates[outer].s[0], 8.5 / 9.5, 0.02);
  EXPECT_NEAR(cells.coordinates[middle].s[1], (90 - 24.5) / 90, 1e-5);
  EXPECT_NEAR(cells.coordinates[middle].s[2], std::atan2(0.5, -29.5), 1e-5);
  EXPECT_NEAR(cells.coordinates[middle].s[3], 4.5, 0.05);
  // Septum, 9 mm thick: the right endocardium is the nearer one beyond its middle.
  const size_t right = at(32.5, 0.5, -24.5);
  EXPECT_EQ(cells.region[right], lv);
  EXPECT_NEAR(cells.coordinates[right].s[0], 7.5 / 9, 0.02);
  EXPECT_NEAR(cells.coordinates[right].s[3], 1.5, 0.05);
}

}  // namespace
}  // namespace cohort::test
