// Excited cells and deforming tissue in one time: what each brings to the other at the ends of windows, and
// whole runs of a bar. References are integrated here by the classical Runge-Kutta method.
#include "solver/electromechanics.hpp"

#include <cmath>
#include <cstdio>

#include "solver/heartbeat.hpp"
#include "solver/simulation.hpp"
#include "solver/time_steps.hpp"
#include "tests/runge_kutta.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {
namespace {

constexpr double rest_mV = -85, amplitude_mV = 105;
const std::string channels = "electrophysiology.stretch_activated.";

/// Mitchell & Schaeffer 2003 at the model's default numbers: v, h.
std::array<double, 2> mitchell_schaeffer(const std::array<double, 2>& y, double mV_per_ms) {
  return {y[1] * y[0] * y[0] * (1 - y[0]) / 0.3 - y[0] / 6 + mV_per_ms / amplitude_mV,
          y[0] < 0.13 ? (1 - y[1]) / 120 : -y[1] / 150};
}

/// A box of excited cells, and the deforming tissue of the same box on a grid of its own, which stands where
/// it is put.
struct Held {
  Held(Scene structure, Settings set, double solid_dx)
      : slab(std::move(structure), with(std::move(set), solid_dx)) {
    Plan plan{};
    plan.cells = slab.grid.cells;
    plan.origin_mm = slab.grid.origin_mm;
    const Grid grid = solid_grid(slab.scene, plan);
    solid = std::make_unique<Solid>(*slab.launcher, slab.scene, scene_definitions(slab.scene, grid), grid, 1,
                                    false, Electromechanics::options(slab.scene));
    solid->build(slab.parameters, {&slab.member, 1});
    coupling = std::make_unique<Electromechanics>(*slab.launcher, slab.scene, slab.definitions);
    const std::size_t first = 0;
    coupling->connect(*solid, *slab.tissue, {&first, 1});
    steps = choose_steps(slab.scene, slab.monodomain->fastest_rate()[0],
                         slab.monodomain->diffusion_limit_ms()[0]);
    slab.monodomain->initialise(*slab.tissue, slab.parameters, steps.dt_ms, steps.substeps);
  }
  static Settings with(Settings set, double solid_dx) {
    for (const auto& one : box_size(4, 2, 2, 0.5)) set.insert(set.begin(), one);
    for (const char* axis : {"x", "y", "z"})
      set.emplace_back("geometry.fibres.direction." + std::string(axis), axis[0] == 'x');
    set.emplace_back("mechanics.dx_mm", solid_dx);
    return set;
  }
  /// The cells go on for a window of 1 ms.
  void excite(int window) {
    for (int n = 0; n < steps.per_sample; ++n)
      slab.monodomain->advance(*slab.tissue, slab.parameters, window + n * steps.dt_ms, window + n == 0);
  }

  Slab slab;
  std::unique_ptr<Solid> solid;
  std::unique_ptr<Electromechanics> coupling;
  TimeSteps steps{};
};

Scene box(const std::string& tension, Precision precision, std::vector<Stimulus> stimuli) {
  Scene scene = Slab::box("mitchell_schaeffer", precision, stimuli, ActivationMethod::monodomain);
  scene.mechanics = Mechanics{.law = "guccione", .tension = tension, .cavities = {}, .boundary = {}};
  return scene;
}

// On the cells' own grid, and on one twice as coarse, whose cells take the mean of eight.
TEST(Electromechanics, TensionFollowsTheCellsPotential) {
  for (const double solid_dx : {0.5, 1.0}) {
    Held held(box("nash_panfilov", Precision::double_, {{"left", Stimulus::Kind::box, {}}}),
              {{"stimuli.left.upper_mm.x", 1},
               {"stimuli.left.upper_mm.y", 9},
               {"stimuli.left.upper_mm.z", 9},
               {"electrophysiology.mitchell_schaeffer.tau_close_ms", 40}},
              solid_dx);
    const SolidMesh& mesh = held.solid->mesh();
    std::vector<std::size_t> cells;
    for (std::size_t i = 0; i < static_cast<std::size_t>(mesh.cells); ++i)
      if (mesh.grid_cell[i] >= 0) cells.push_back(i);
    ASSERT_EQ(cells.size(), solid_dx == 1 ? 16u : 128u);
    // The cell's mean potential at the ends of windows, by places.
    const auto mean = [&](std::size_t cell) {
      const std::vector<double> V = held.slab.potential();
      const std::array<double, 3> centre = held.solid->centre(cell);
      double sum = 0;
      int count = 0;
      held.slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
        bool inside = true;
        for (std::size_t k = 0; k < 3; ++k) inside = inside && std::abs(p[k] - centre[k]) < 0.5 * solid_dx;
        if (!inside) return;
        sum += V[i];
        ++count;
      });
      EXPECT_EQ(count, solid_dx == 1 ? 8 : 1);
      return sum / count;
    };
    constexpr int windows = 200, parts = 5;
    const std::vector<std::size_t> looked = {cells.front(), cells[cells.size() / 2], cells.back()};
    std::vector<std::array<double, 1>> T(looked.size(), {0});
    std::vector<double> before;
    for (const std::size_t cell : looked) before.push_back(mean(cell));
    std::vector<double> state = held.solid->state();
    double worst = 0, peak = 0, apart = 0;
    for (int window = 0; window < windows; ++window) {
      if (window == 0)
        held.coupling->drive(*held.solid, *held.slab.tissue, *held.slab.monodomain, 0, 1, true);
      held.excite(window);
      held.coupling->drive(*held.solid, *held.slab.tissue, *held.slab.monodomain, window, 1, false);
      for (int part = 1; part <= parts; ++part) {
        state[Solid::beat_time] = window + part / double{parts};
        state[Solid::step] = state[Solid::odd_step] = 1.0 / parts;
        state[Solid::load_share] = 1;
        held.solid->set_state(state);
        held.solid->forces(held.slab.parameters);
      }
      const std::vector<double> found = held.solid->tensions();
      for (std::size_t k = 0; k < looked.size(); ++k) {
        const double now = mean(looked[k]), then = before[k];
        for (int part = 0; part < 20; ++part)
          advance(T[k], part / 20.0, 1 / 20.0, [&](double t, const std::array<double, 1>& z) {
            const double v = (then + t * (now - then) + 80) / 100;
            const double rate = 0.01 + 0.09 * std::exp(-std::exp(-100 * (v - 0.05)));
            return std::array<double, 1>{rate * (47.9 * std::max(v, 0.0) - z[0])};
          });
        before[k] = now;
        peak = std::max(peak, T[k][0]);
        worst = std::max(worst, std::abs(found[looked[k]] - T[k][0]));
      }
      apart = std::max(apart, std::abs(found[looked.front()] - found[looked.back()]));
    }
    std::printf(
        "cells of %.1f mm: peak %.3f kPa, largest difference %.2e kPa, ends of the box apart by %.2f\n",
        solid_dx, peak, worst, apart);
    EXPECT_GT(peak, 35);
    EXPECT_GT(apart, 0.1);  // there is a front
    EXPECT_LT(worst, 2e-3 * peak);
  }
}

// Windows lose no time: under a constant potential the tension is its closed form, to rounding, however the
// steps of a window were shared.
TEST(Electromechanics, WindowsLoseNoTime) {
  Scene structure = box("nash_panfilov", Precision::double_, {{"left", Stimulus::Kind::box, {}}});
  Held held(std::move(structure), {{"mechanics.nash_panfilov.length_slope", 0}, {"time.end_ms", 100}}, 1);
  Solid& solid = *held.solid;
  const auto cells = static_cast<std::size_t>(solid.mesh().cells);
  const std::vector<double> excited(2 * cells, 20);  // mV: normalised 1
  const cl::Buffer drive = device().allocate(excited.size() * sizeof(double));
  held.slab.write(drive, excited);
  solid.drive(drive, drive, {0, 1, 0, 0});
  std::size_t cell = 0;
  while (solid.mesh().grid_cell[cell] < 0) ++cell;
  int steps = 0;
  const auto step = [&](bool measured) {
    if (measured) solid.measure(held.slab.parameters);
    solid.forces(held.slab.parameters);
    solid.predict(measured);
    solid.load(measured);
    solid.move();
    ++steps;
  };
  const auto waits = [&] { return solid.state()[Solid::waits] != 0; };
  step(true);
  ASSERT_TRUE(waits());  // at 0
  for (const double window_end : {0.7, 1.7, 2.0, 3.5, 10.0, 11.0, 20.0}) {
    solid.release(window_end);
    for (int n = 0; n < 3 || !waits(); ++n) step(n % 16 == 0);
    for (int more = 0; more < 3; ++more) step(false);  // of others in the batch
    EXPECT_NEAR(solid.state()[Solid::beat_time], window_end, 1e-9);
    solid.release(window_end + 1e-3);
    solid.forces(held.slab.parameters);                 // of the last step
    const double load = std::min(window_end / 5, 1.0);  // mechanics.load.ramp_ms
    EXPECT_NEAR(solid.tensions()[cell], load * 47.9 * (1 - std::exp(-window_end / 10)), 1e-9) << window_end;
    solid.set_state([&] {  // back to the window's end
      std::vector<double> state = solid.state();
      state[Solid::held_behind] = 0;  // that step is taken
      state[Solid::waits] = 1;
      return state;
    }());
  }
  EXPECT_GT(steps, 100);
}

// A slab that is held at a stretch: each cell is the single cell with the current of open channels.
TEST(Electromechanics, StretchOpensChannels) {
  constexpr double g = 0.003, reversal = -15, reference = 1.2, dt = 0.01;
  for (const double stretch : {1.15, 0.9}) {
    Scene structure = box("nash_panfilov", Precision::double_, {});
    structure.stretch_activated = true;
    Held held(std::move(structure),
              {{channels + "conductance_mS_per_uF", g},
               {channels + "reversal_mV", reversal},
               {channels + "reference_stretch", reference}},
              1);
    const SolidMesh& mesh = held.solid->mesh();
    const auto nodes = static_cast<std::size_t>(mesh.nodes);
    std::vector<double> u(3 * nodes, 0);
    for (std::size_t a = 0; a < nodes; ++a)
      if (mesh.vertex[a] >= 0) u[a] = (stretch - 1) * mesh.position[a];
    held.solid->set_motion(u, std::vector<double>(3 * nodes, 0));
    held.solid->forces(held.slab.parameters);
    held.coupling->stretch(*held.solid, *held.slab.tissue, *held.slab.monodomain, held.slab.parameters);
    const double rate = stretch > 1 ? g * (stretch - 1) / (reference - 1) : 0;
    const std::vector<double> rates = held.slab.read(held.slab.monodomain->stretch_rate(),
                                                     static_cast<std::size_t>(held.slab.tissue->stride));
    int cells = 0;
    held.slab.each_cell([&](std::size_t i, const std::array<double, 3>&) {
      EXPECT_NEAR(rates[i], rate, 1e-12);
      ++cells;
    });
    EXPECT_EQ(cells, 128);
    // From rest for 150 ms, then an action potential.
    std::array<double, 2> y = {0, 1};
    double worst = 0, shift = 0;
    for (int window = 0; window < 480; ++window) {
      if (window == 150) {
        held.slab.write(held.slab.monodomain->potential(),
                        held.slab.field([](double, double, double) { return 0.0; }, rest_mV));
        y[0] = -rest_mV / amplitude_mV;
      }
      held.excite(window);
      for (int n = 0; n < std::lround(1 / dt); ++n)
        advance(y, 0, dt, [&](double, const std::array<double, 2>& z) {
          return mitchell_schaeffer(z, -rate * (rest_mV + amplitude_mV * z[0] - reversal));
        });
      const std::vector<double> V = held.slab.potential();
      const double expected = rest_mV + amplitude_mV * y[0];
      if (window == 149) shift = expected - rest_mV;
      // The upstroke of the written potential and repolarisation are steep: a shift of the step in time.
      held.slab.each_cell([&](std::size_t i, const std::array<double, 3>&) {
        worst = std::max(worst, std::abs(V[i] - expected));
      });
    }
    std::printf("stretch %.2f: rate %.4f 1/ms, rest shifts by %.3f mV, largest difference %.4f mV\n", stretch,
                rate, shift, worst);
    if (stretch > 1) {
      EXPECT_GT(shift, 0.8);
    } else {
      EXPECT_EQ(shift, 0);
    }
    EXPECT_LT(worst, 0.3);
  }
}

/// A bar along x whose left end is held, excited at its left end.
struct Bar {
  explicit Bar(const std::string& tension, ActivationMethod method, bool stretch_activated = false) {
    using K = Shape::Kind;
    scene.geometry = GeometryKind::shapes;
    scene.activation_method = method;
    scene.shapes = {
        {"block", K::box, {}}, {"right", K::half_space, {}}, {"bar", K::intersection, {"block", "right"}}};
    scene.regions = {{.name = "muscle", .shape = "bar", .fibres = Region::Fibres::constant}};
    scene.stimuli = {{"left", Stimulus::Kind::box, {}}};
    scene.activation.emplace();
    scene.displacement.emplace().points = {"end"};
    scene.stretch_activated = stretch_activated;
    Mechanics& mechanics = scene.mechanics.emplace();
    mechanics.tension = tension;
    mechanics.boundary = {{"left", "right", Mechanics::Boundary::Kind::clamp}};
    declare_parameters(scene);
    const std::string box = "geometry.shapes.block.box.", half = "geometry.shapes.right.half_space.";
    for (const auto& [path, value] : Settings{{box + "size_mm.x", 24},
                                              {box + "size_mm.y", 4},
                                              {box + "size_mm.z", 4},
                                              {box + "centre_mm.x", 0},
                                              {box + "centre_mm.y", 2},
                                              {box + "centre_mm.z", 2},
                                              {half + "normal.x", -1},
                                              {half + "normal.z", 0},
                                              {"geometry.fibres.direction.x", 1},
                                              {"geometry.fibres.direction.y", 0},
                                              {"geometry.fibres.direction.z", 0},
                                              {"grid.dx_mm", 1},
                                              {"time.end_ms", 60},
                                              {"stimuli.left.upper_mm.x", 1.2},
                                              {"stimuli.left.upper_mm.y", 4},
                                              {"stimuli.left.upper_mm.z", 4},
                                              {"outputs.displacement.points.end_mm.x", 12},
                                              {"outputs.displacement.points.end_mm.y", 2},
                                              {"outputs.displacement.points.end_mm.z", 2},
                                              {"mechanics." + tension + ".peak_kPa", 20},
                                              {"electrophysiology.conductivity_longitudinal_mS_per_mm", 1},
                                              {"electrophysiology.conductivity_transverse_mS_per_mm", 1}})
      if (scene.parameters.find(path) >= 0)
        scene.parameters[scene.parameters.index(path)].value = value;
      else
        ADD_FAILURE() << path;
  }
  std::vector<Recording> run(const std::vector<Settings>& by_member) { return run(by_member, 1)[0]; }
  /// The same batch several times, by one simulation.
  std::vector<std::vector<Recording>> run(const std::vector<Settings>& by_member, int times) {
    std::vector<Member> members;
    for (const Settings& own : by_member) {
      Member member{static_cast<std::int64_t>(members.size()), scene.parameters.values()};
      for (const auto& [path, value] : own)
        member.values[static_cast<std::size_t>(scene.parameters.index(path))] = value;
      scene.parameters.resolve(member.values);
      members.push_back(std::move(member));
    }
    PlanOptions options;
    options.members_per_device = static_cast<int>(members.size());
    const Plan plan = make_plan(device(), scene, members, options);
    Simulation simulation(device(), scene, plan);
    std::vector<std::vector<Recording>> result;
    for (int n = 0; n < times; ++n) result.push_back(simulation.run(members, 600));
    return result;
  }
  Scene scene;
};

std::string defect(const Recording& recording) {
  return recording.outcome == Outcome::done ? "" : "not done: " + recording.reason;
}
/// The lowest x displacement.
float shortening(const Recording& recording) {
  const std::size_t samples = recording.displacement.size() / 3;
  return *std::min_element(recording.displacement.begin(),
                           recording.displacement.begin() + static_cast<std::ptrdiff_t>(samples));
}

// Members whose steps and windows take different numbers of launches, one with cells whose steps are its own,
// and one that is rejected: bit for bit what each is alone, also in a second batch.
TEST(Electromechanics, MembersDoNotSeeEachOther) {
  Bar bar("nash_panfilov", ActivationMethod::monodomain, true);
  const std::vector<Settings> each = {
      {{"mechanics.bulk_modulus_kPa", 100}},
      {{"mechanics.bulk_modulus_kPa", 900}, {"mechanics.nash_panfilov.peak_kPa", 35}},
      {{"stimuli.left.upper_mm.x", -5}},  // reaches no tissue
      {{"electrophysiology.mitchell_schaeffer.tau_in_ms", 0.08}},
      {{"electrophysiology.conductivity_longitudinal_mS_per_mm", 0.6}}};
  const auto together = bar.run(each, 2);
  for (std::size_t m = 0; m < each.size(); ++m) {
    const Recording alone = bar.run({each[m]}, 1)[0][0];
    for (const std::vector<Recording>& batch : together) {
      EXPECT_EQ(batch[m].outcome, m == 2 ? Outcome::rejected : Outcome::done) << batch[m].reason;
      EXPECT_EQ(batch[m].outcome, alone.outcome);
      if (m == 2) continue;
      EXPECT_EQ(batch[m].displacement, alone.displacement) << m;
      EXPECT_EQ(batch[m].features, alone.features) << m;
      EXPECT_LT(shortening(batch[m]), -0.3) << m;
    }
  }
  EXPECT_NE(together[0][0].displacement, together[0][1].displacement);
  EXPECT_NE(together[0][0].dt_ms, together[0][3].dt_ms);
}

// Channels that conduct nothing change no bit, those that do change the cells and the shortening.
TEST(Electromechanics, NoFeedbackIsNoFeedback) {
  for (const char* tension : {"nash_panfilov", "twitch"}) {
    Bar off(tension, ActivationMethod::monodomain), on(tension, ActivationMethod::monodomain, true);
    const Recording without = off.run({{}})[0];
    const std::vector<Recording> with =
        on.run({{{channels + "conductance_mS_per_uF", 0}}, {{channels + "conductance_mS_per_uF", 0.4}}});
    ASSERT_EQ(defect(without) + defect(with[0]) + defect(with[1]), "");
    EXPECT_EQ(without.features, with[0].features);
    if (std::string(tension) == "nash_panfilov") {  // a twitch goes to windows by the feedback alone
      EXPECT_EQ(without.displacement, with[0].displacement);
    }
    EXPECT_NEAR(shortening(without), shortening(with[0]), 2e-3f * std::abs(shortening(without)));
    EXPECT_NE(with[0].displacement, with[1].displacement);
  }
}

// A twitch follows recorded activation times, whoever records them.
TEST(Electromechanics, TwitchFollowsRecordedActivationTimes) {
  Bar resolved("twitch", ActivationMethod::monodomain),
      triggered("twitch", ActivationMethod::reaction_eikonal);
  const Recording a = resolved.run({{}})[0], b = triggered.run({{}})[0];
  ASSERT_EQ(defect(a) + defect(b), "");
  EXPECT_LT(shortening(a), -0.3);
  EXPECT_NEAR(shortening(a), shortening(b), 0.05 * std::abs(shortening(a)));
}

}  // namespace
}  // namespace cohort::test
