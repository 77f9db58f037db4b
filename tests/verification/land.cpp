#include <gtest/gtest.h>

#include "solver/solid.hpp"
#include "solver/parameter_block.hpp"
#include "solver/precision.hpp"
#include "tests/slab.hpp"

namespace cohort {
namespace {

using test::device;

struct LandResult { double endo, epi, steps, volume, residual, seconds; };

LandResult land(int problem, double dx, double kappa, double tolerance, Precision precision = Precision::single_) {
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.precision = precision;
  using K = Shape::Kind;
  scene.shapes = {{"outer", K::ellipsoid, {}}, {"inner", K::ellipsoid, {}}, {"below_base", K::half_space, {}},
                  {"shell", K::subtract, {"outer", "inner"}}, {"wall", K::intersection, {"shell", "below_base"}},
                  {"blood", K::intersection, {"inner", "below_base"}}};
  scene.regions = {{"wall", "wall", true, Region::Fibres::transmural}};
  Mechanics& m = scene.mechanics.emplace();
  m.cavities = {{"lv", "blood"}};
  m.boundary = {{"base", "below_base", Mechanics::Boundary::Kind::clamp}};
  m.quasi_static = true;
  if (problem == 3) m.tension = "constant";
  declare_parameters(scene);
  const auto set = [&](const std::string& path, double value) { scene.parameters[scene.parameters.index(path)].value = value; };
  set("grid.dx_mm", dx);
  for (const char* s : {"outer", "inner"}) {
    const double add = s[0] == 'o' ? 3 : 0;
    const std::string p = std::string("geometry.shapes.") + s + ".ellipsoid.";
    set(p + "centre_mm.z", -5);
    set(p + "semi_axes_mm.x", 7 + add); set(p + "semi_axes_mm.y", 7 + add); set(p + "semi_axes_mm.z", 17 + add);
  }
  set("geometry.fibres.endocardium_deg", 90);
  set("geometry.fibres.epicardium_deg", -90);
  set("mechanics.bulk_modulus_kPa", kappa);
  double pressure = 10;
  if (problem == 3) {
    set("mechanics.guccione.C_kPa", 2); set("mechanics.guccione.bf", 8); set("mechanics.guccione.bt", 2); set("mechanics.guccione.bfs", 4);
    set("mechanics.constant.tension_kPa", 60);
    pressure = 15;
  }
  Member member{0, scene.parameters.values()};
  scene.parameters.resolve(member.values);
  const Grid grid = make_grid(scene, {&member, 1});
  const Definitions definitions = scene_definitions(scene, grid);
  Launcher launcher(device(), precision);
  Solid solid(launcher, scene, definitions, grid, 1);
  const auto packed = pack(member.values, precision);
  cl::Buffer parameters = device().allocate(packed.size());
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
  solid.build(parameters, {&member, 1});
  EXPECT_EQ(solid.defect(0), "");
  const auto start = std::chrono::steady_clock::now();
  std::vector<double> state;
  for (int step = 0; step < 40000; ++step) {
    const bool measured = step % 16 == 0;
    if (measured) solid.measure(parameters);
    solid.forces(parameters);
    solid.predict();
    solid.load({pressure}, {5, 1e9, tolerance, 1}, measured);
    solid.move();
    if (step % 100 == 99) {
      state = solid.state();
      if (getenv("VERBOSE")) printf("%d t %g dt %g J %g res %g KE %g V %g E %g load %g ended %g\n", step, state[0], state[3], state[9], state[8], state[7], state[20], state[11], state[5], state[12]);
      if (state[12] != 0) break;
    }
  }
  const auto u = solid.displacement();
  const auto endo = solid.displacement_at(0, {0, 0, -22}, u), epi = solid.displacement_at(0, {0, 0, -25}, u);
  LandResult r{endo[2] - 17, epi[2] - 20, state[13], state[20], state[8], std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
  printf("problem %d dx %g kappa %g cells %d: endo %.3f epi %.3f V %.1f steps %g residual %g ended %g J %.3f %.1f s\n", problem, dx, kappa, solid.mesh().tissue_cells[0], r.endo, r.epi, r.volume, r.steps, r.residual, state[12], state[9], r.seconds);
  return r;
}

TEST(Land, Experiment) {
  const char* list = getenv("DX");
  std::istringstream in(list ? list : "2 1");
  const double kappa = getenv("KAPPA") ? atof(getenv("KAPPA")) : 350;
  const double tol = getenv("TOL") ? atof(getenv("TOL")) : 1e-3;
  for (double dx; in >> dx;)
    for (int problem : {2, 3}) if (!getenv("PROBLEM") || atoi(getenv("PROBLEM")) == problem) land(problem, dx, kappa, tol);
}
}  // namespace
}  // namespace cohort
