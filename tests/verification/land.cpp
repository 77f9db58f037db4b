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
  if (problem == 2) { set("mechanics.guccione.C_kPa", 10); for (const char* b : {"bf", "bt", "bfs"}) set(std::string("mechanics.guccione.") + b, 1); }
  if (problem == 3) {
    set("mechanics.guccione.C_kPa", 2); set("mechanics.guccione.bf", 8); set("mechanics.guccione.bt", 2); set("mechanics.guccione.bfs", 4);
    set("mechanics.constant.peak_kPa", 60);
    pressure = 15;
  }
  set("mechanics.cavities.lv.pressure_kPa", pressure); set("mechanics.load.tolerance", tolerance);
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
    solid.load(measured);
    solid.move();
    if (step % 100 == 99) {
      state = solid.state();
      if (getenv("VERBOSE")) printf("%d t %g dt %g J %g res %g KE %g V %g E %g load %g ended %g\n", step, state[0], state[Solid::largest_step], state[Solid::smallest_J], state[Solid::residual], state[Solid::kinetic], state[Solid::first_volume], state[Solid::strain_energy], state[Solid::load_share], state[Solid::ended]);
      if (state[Solid::ended] != 0) break;
    }
  }
  const auto u = solid.displacement();
  const auto endo = solid.displacement_at(0, {0, 0, -22}, u), epi = solid.displacement_at(0, {0, 0, -25}, u);
  LandResult r{endo[2] - 17, epi[2] - 20, state[Solid::steps_done], state[Solid::first_volume], state[Solid::residual], std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
  printf("problem %d dx %g kappa %g cells %d: endo %.3f epi %.3f V %.1f steps %g residual %g ended %g J %.3f %.1f s\n", problem, dx, kappa, solid.mesh().tissue_cells[0], r.endo, r.epi, r.volume, r.steps, r.residual, state[Solid::ended], state[Solid::smallest_J], r.seconds);
  return r;
}


void heart(double dx, double kappa, double lv_mmHg, double rv_mmHg, double tension) {
  Scene scene;
  scene.geometry = GeometryKind::heart;
  Mechanics& m = scene.mechanics.emplace();
  m.cavities = {{"lv", ""}, {"rv", ""}};
  using B = Mechanics::Boundary;
  m.boundary = {{"base", "base", B::Kind::clamp_normal}, {"base_spring", "base", B::Kind::spring}, {"epicardium", "epicardium", B::Kind::spring_normal}};
  m.quasi_static = true;
  m.tension = "constant";
  ConductionSystem& c = scene.conduction_system.emplace(); c.kind = ConductionSystem::Kind::delay;
  declare_parameters(scene);
  const auto set = [&](const std::string& path, double value) { scene.parameters[scene.parameters.index(path)].value = value; };
  set("grid.dx_mm", dx);
  set("mechanics.bulk_modulus_kPa", kappa);
  set("mechanics.guccione.C_kPa", getenv("CC") ? atof(getenv("CC")) : 0.8); set("mechanics.guccione.bf", 8); set("mechanics.guccione.bt", 3); set("mechanics.guccione.bfs", 4);
  set("mechanics.constant.peak_kPa", tension);
  set("mechanics.boundary.base_spring.stiffness_kPa_per_mm", 0.5);
  set("mechanics.boundary.epicardium.stiffness_kPa_per_mm", 0.1);
  set("mechanics.cavities.lv.pressure_kPa", lv_mmHg / 7.50062); set("mechanics.cavities.rv.pressure_kPa", rv_mmHg / 7.50062); set("mechanics.load.tolerance", 2e-3);
  Member member{0, scene.parameters.values()};
  scene.parameters.resolve(member.values);
  const Grid grid = make_grid(scene, {&member, 1});
  const Definitions definitions = scene_definitions(scene, grid);
  Launcher launcher(device(), scene.precision);
  Solid solid(launcher, scene, definitions, grid, 1);
  const auto packed = pack(member.values, scene.precision);
  cl::Buffer parameters = device().allocate(packed.size());
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
  const auto s0 = std::chrono::steady_clock::now();
  solid.build(parameters, {&member, 1});
  printf("setup %.3f s defect '%s'\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - s0).count(), solid.defect(0).c_str());
  const auto start = std::chrono::steady_clock::now();
  std::vector<double> state;
  for (int step = 0; step < 40000; ++step) {
    const bool measured = step % 16 == 0;
    if (measured) solid.measure(parameters);
    solid.forces(parameters);
    solid.predict();
    solid.load(measured);
    solid.move();
    if (step == 15) { state = solid.state(); printf("rest volumes %.2f %.2f mL\n", state[Solid::first_volume] / 1000, state[Solid::first_volume + 1] / 1000); }
    if (step % 100 == 99) {
      state = solid.state();
      if (getenv("VERBOSE")) printf("%d t %g dt %g J %g res %g KE %g V %g %g E %g ended %g\n", step, state[0], state[Solid::largest_step], state[Solid::smallest_J], state[Solid::residual], state[Solid::kinetic], state[Solid::first_volume]/1000, state[Solid::first_volume + 1]/1000, state[Solid::strain_energy], state[Solid::ended]);
      if (state[Solid::ended] != 0) break;
    }
  }
  printf("heart dx %g cells %d items %d cavity nodes %d: V %.2f %.2f mL steps %g residual %g ended %g J %.3f dt %.4f %.1f s\n", dx, solid.mesh().tissue_cells[0], solid.mesh().items, solid.mesh().cavity_nodes, state[Solid::first_volume]/1000, state[Solid::first_volume + 1]/1000, state[Solid::steps_done], state[Solid::residual], state[Solid::ended], state[Solid::smallest_J], state[Solid::largest_step], std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}
TEST(Land, Heart) {
  std::istringstream in(getenv("HDX") ? getenv("HDX") : "4");
  const double T = getenv("T") ? atof(getenv("T")) : 0, lv = getenv("LV") ? atof(getenv("LV")) : 8.7, rv = getenv("RV") ? atof(getenv("RV")) : 3.8;
  for (double dx; in >> dx;) heart(dx, 350, lv, rv, T);
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
