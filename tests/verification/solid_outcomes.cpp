// What cannot run is told before it does, and what goes wrong ends as an outcome with a place, in the
// deforming tissue.
#include <limits>

#include "solver/plan_mechanics.hpp"
#include "solver/solid_walls.hpp"
#include "tests/campaign_run.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

using Kind = Mechanics::Boundary::Kind;

Settings ventricle(double wall = 4, double dx = 2) {
  Settings set = ellipsoids({6, 6, 12}, wall, dx);
  set.emplace_back("geometry.shapes.below_base.half_space.point_mm.z", 0);
  set.emplace_back("time.end_ms", 100);
  return set;
}
Scene open_ventricle(bool held = true) {
  return hollow(true, "neo_hookean", Precision::single_, held);
}

std::string defect_of(Scene scene, const Settings& set) {
  return SolidRun(std::move(scene), set).solid->defect(0);
}

TEST(SolidDefects, CavitiesThatAreNotClosed) {
  EXPECT_EQ(defect_of(open_ventricle(), ventricle()), "");
  // Blood that stands above the base.
  Scene scene = open_ventricle();
  scene.mechanics->cavities = {{"lv", "inner"}};
  EXPECT_EQ(defect_of(std::move(scene), ventricle()),
            "mechanics.cavities.lv: the cavity is not closed: tissue and one plane along the grid do not "
            "enclose its "
            "blood");
  // A wall with a hole.
  using K = Shape::Kind;
  scene = open_ventricle();
  scene.shapes = {{"outer", K::ellipsoid, {}},
                  {"inner", K::ellipsoid, {}},
                  {"below_base", K::half_space, {}},
                  {"hole", K::capsule, {}},
                  {"shell", K::subtract, {"outer", "inner", "hole"}},
                  {"wall", K::intersection, {"shell", "below_base"}},
                  {"blood", K::intersection, {"inner", "below_base"}}};
  Settings set = ventricle();
  set.insert(set.end(), {{"geometry.shapes.hole.capsule.from_mm.x", 0},
                         {"geometry.shapes.hole.capsule.from_mm.y", 0},
                         {"geometry.shapes.hole.capsule.from_mm.z", -6},
                         {"geometry.shapes.hole.capsule.to_mm.x", 30},
                         {"geometry.shapes.hole.capsule.to_mm.y", 0},
                         {"geometry.shapes.hole.capsule.to_mm.z", -6},
                         {"geometry.shapes.hole.capsule.radius_mm", 2.5}});
  EXPECT_NE(defect_of(std::move(scene), set).find("is not closed"), std::string::npos);
  // Blood without an end: a half-space beside a slab.
  Scene slab;
  slab.geometry = GeometryKind::shapes;
  slab.shapes = {
      {"slab", K::box, {}}, {"below", K::half_space, {}}, {"wall", K::subtract, {"slab", "below"}}};
  slab.regions = {{.name = "wall", .shape = "wall"}};
  slab.mechanics =
      Mechanics{.law = "neo_hookean", .tension = {}, .cavities = {{"sea", "below"}}, .boundary = {}};
  EXPECT_EQ(defect_of(std::move(slab), {{"grid.dx_mm", 1},
                                        {"geometry.shapes.slab.box.size_mm.x", 40},
                                        {"geometry.shapes.slab.box.size_mm.y", 40},
                                        {"geometry.shapes.slab.box.size_mm.z", 8},
                                        {"geometry.shapes.slab.box.centre_mm.x", 0},
                                        {"geometry.shapes.slab.box.centre_mm.y", 0},
                                        {"geometry.shapes.slab.box.centre_mm.z", 0},
                                        {"geometry.shapes.below.half_space.point_mm.z", 0}})
                .substr(0, 49),
            "mechanics.cavities.sea: the cavity is not closed:");
}

TEST(SolidDefects, CavityWithoutCellsAndConditionsOfNothing) {
  Settings set = ventricle();
  for (const char* axis : {"x", "y", "z"})
    set.emplace_back(std::string("geometry.shapes.inner.ellipsoid.semi_axes_mm.") + axis, 0.6);
  EXPECT_EQ(defect_of(open_ventricle(), set),
            "mechanics.cavities.lv: the cavity holds no cell: no cell of the grid is mostly its blood");
  // A base beyond the tissue.
  for (const Kind kind : {Kind::clamp, Kind::clamp_normal, Kind::spring, Kind::spring_normal}) {
    Scene scene = open_ventricle();
    scene.mechanics->boundary = {{"ring", "below_base", kind}};
    scene.mechanics->cavities = {{"lv", "inner"}};
    set = ventricle();
    set.emplace_back("geometry.shapes.below_base.half_space.point_mm.z", 60);
    const bool clamp = kind == Kind::clamp || kind == Kind::clamp_normal;
    EXPECT_EQ(defect_of(std::move(scene), set),
              std::string("mechanics.boundary.ring: the ") + (clamp ? "clamp" : "spring") +
                  " holds nothing: surface \"below_base\" bounds no cell of the tissue");
  }
}

TEST(SolidDefects, FreeMotionsAreCounted) {
  struct Case {
    std::vector<Mechanics::Boundary> boundary;
    int free;
  };
  const std::vector<Case> cases = {
      {{}, 6},
      {{{"a", "z_lower", Kind::clamp}}, 0},
      {{{"a", "z_lower", Kind::clamp_normal}}, 3},
      {{{"a", "z_lower", Kind::clamp_normal}, {"b", "x_lower", Kind::clamp_normal}}, 1},
      {{{"a", "z_lower", Kind::clamp_normal},
        {"b", "x_lower", Kind::clamp_normal},
        {"c", "y_upper", Kind::clamp_normal}},
       0},
      {{{"a", "z_upper", Kind::spring}}, 0},
      {{{"a", "z_upper", Kind::spring_normal}}, 3},
  };
  for (const Case& c : cases) {
    SolidRun run(box_of_tissue("neo_hookean", Precision::single_, c.boundary), box_size(6, 5, 4, 1));
    EXPECT_EQ(run.solid->free_motions(0), c.free) << c.boundary.size();
  }
  // A spring without stiffness holds nothing.
  Settings set = box_size(6, 5, 4, 1);
  set.emplace_back("mechanics.boundary.a.stiffness_kPa_per_mm", 0);
  SolidRun run(box_of_tissue("neo_hookean", Precision::single_, {{"a", "z_upper", Kind::spring}}), set);
  EXPECT_EQ(run.solid->free_motions(0), 6);
}

TEST(SolidDefects, WallsAreMeasured) {
  for (const double dx : {1.0, 2.0}) {
    SolidRun closed(hollow(false, "neo_hookean", Precision::single_, false), ellipsoids({8, 8, 8}, 3, dx));
    EXPECT_NEAR(dx * thin_wall_cells(closed.mesh(), closed.grid, 1, 0, 0), 3, 0.2 * dx);
    SolidRun open(open_ventricle(), ventricle(4, dx));
    EXPECT_NEAR(dx * thin_wall_cells(open.mesh(), open.grid, 1, 0, 0), 4, 0.3 * dx);
  }
}

/// Steps until the members have ended, 4096 at most; the first one's end.
SolidEnd steps_to_end(SolidRun& run) {
  for (int step = 0; step < 4096; ++step) {
    run.loaded_step(step % 16 == 0);
    if (step % 16 == 15 && run.solid->state()[Solid::ended] != 0) break;
  }
  return static_cast<SolidEnd>(static_cast<int>(run.solid->state()[Solid::ended]));
}
bool failed(SolidEnd end) {
  return end == SolidEnd::inverted || end == SolidEnd::runaway || end == SolidEnd::stiff ||
         end == SolidEnd::overstepped;
}

TEST(SolidOutcomes, ACalmMemberSettles) {
  SolidRun run(open_ventricle(), ventricle());
  EXPECT_EQ(steps_to_end(run), SolidEnd::settled);
  EXPECT_GT(run.solid->worst_cell(0).second, 0.9);
}

TEST(SolidOutcomes, APressureBeyondTheTissueEndsIt) {
  Settings set = ventricle();
  set.emplace_back("mechanics.cavities.lv.pressure_kPa", 100);
  SolidRun run(open_ventricle(), set);
  const SolidEnd end = steps_to_end(run);
  EXPECT_TRUE(failed(end)) << static_cast<int>(end);
  const std::string why = run.solid->failure(0, end);
  EXPECT_NE(why.find(" at ("), std::string::npos) << why;
  EXPECT_NE(why.find(") mm, region wall"), std::string::npos) << why;
  const double time = run.solid->state()[Solid::time];
  EXPECT_GT(time, 0);
  EXPECT_LT(time, 100);
}

TEST(SolidOutcomes, StepsBeyondTheBoundEndIt) {
  SolidRun run(open_ventricle(), ventricle());
  run.solid->measure(run.parameters);
  run.loaded_step(true);
  std::vector<double> S = run.solid->state();
  // As if waves were half as fast; looks at the cells set it right, so there is none until the end.
  S[Solid::step] = S[Solid::odd_step] = S[Solid::largest_step] = 2 * S[Solid::largest_step];
  run.solid->set_state(S);
  run.solid->set_motion(run.random_field(1e-3, 1), run.at_rest());
  SolidEnd end = SolidEnd::moves;
  for (int step = 0; step < 2000 && end == SolidEnd::moves; ++step) {
    run.loaded_step(false);
    if (step % 16 == 15) end = static_cast<SolidEnd>(static_cast<int>(run.solid->state()[Solid::ended]));
  }
  EXPECT_EQ(end, SolidEnd::runaway);
  const std::string why = run.solid->failure(0, end);
  EXPECT_EQ(why.find("the tissue runs away"), 0u) << why;
}

TEST(SolidOutcomes, ANodeThatIsNoNumberIsFound) {
  for (const bool velocity : {false, true}) {
    SolidRun run(open_ventricle(), ventricle());
    std::size_t node = 0;
    for (std::size_t a = 0; a < run.nodes(); ++a)
      if (run.is_node(a) && run.place(a)[2] < -13) node = a;
    std::vector<double> u = run.at_rest(), v = run.at_rest();
    (velocity ? v : u)[node] = std::numeric_limits<double>::quiet_NaN();
    run.solid->set_motion(u, v);
    for (int step = 0; step < 3; ++step) run.loaded_step(false);  // no look at the cells: the nodes tell
    const std::vector<double> S = run.solid->state();
    EXPECT_EQ(S[Solid::ended], static_cast<double>(SolidEnd::runaway));
    EXPECT_LT(S[Solid::steps_done], 3);
    const std::string why = run.solid->failure(0, SolidEnd::runaway);
    EXPECT_EQ(why.find("the tissue runs away: its energy is no number; smallest volume ratio nan at ("), 0u)
        << why;
  }
}

// Tissue that contracts without any pressure has come to rest only once its forces balance.
TEST(SolidOutcomes, RestWithoutPressureIsBalance) {
  const auto volume = [](double tolerance) {
    Scene scene = open_ventricle();
    scene.mechanics->tension = "constant";
    scene.mechanics->quasi_static = true;
    Settings set = ventricle();
    set.insert(set.end(), {{"mechanics.neo_hookean.mu_kPa", 20},
                           {"mechanics.constant.peak_kPa", 10},
                           {"mechanics.load.tolerance", tolerance}});
    SolidRun run(std::move(scene), set);
    const double rest = run.measured(run.at_rest()).volume_mm3;
    run.solid->set_state(run.start);
    run.solid->set_motion(run.at_rest(), run.at_rest());
    EXPECT_EQ(steps_to_end(run), SolidEnd::settled);
    return run.solid->state()[Solid::first_volume] / rest;
  };
  const double usual = volume(1e-3), tight = volume(2e-5);
  std::printf("volume over that at rest: %.5f, and %.5f at a residual of 2e-5\n", usual, tight);
  EXPECT_LT(tight, 0.9);
  EXPECT_NEAR(usual, tight, 2e-3);
}

}  // namespace
}  // namespace cohort::test
