// From a scene's parameters to the potential: conductivities along and across fibres, stimuli, samples,
// probes.
#include <cmath>
#include <cstdio>

#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

const std::string ep = "electrophysiology.";
const std::string ms = ep + "mitchell_schaeffer.";

// Second moment along direction n of what is left after `time` ms of pure diffusion from one cell: 2 D_nn
// time. Reaction is off: tau_in and tau_out are so long that nothing happens.
double spread(std::array<double, 3> fibre, std::array<double, 3> n, double longitudinal, double transverse) {
  constexpr double h = 0.25, size = 12.25, dt = 0.02, time = 2;
  Slab slab({size, size, size}, h, Precision::double_, "mitchell_schaeffer",
            {{ep + "conductivity_longitudinal_mS_per_mm", longitudinal},
             {ep + "conductivity_transverse_mS_per_mm", transverse},
             {"geometry.fibres.direction.x", fibre[0]},
             {"geometry.fibres.direction.y", fibre[1]},
             {"geometry.fibres.direction.z", fibre[2]},
             {ms + "tau_in_ms", 1e12},
             {ms + "tau_out_ms", 1e12},
             {ms + "resting_mV", 0},
             {ms + "amplitude_mV", 1}});
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  const double middle = size / 2;
  slab.write(slab.monodomain->potential(), slab.field([&](double x, double y, double z) {
    return std::abs(x - middle) < 0.1 && std::abs(y - middle) < 0.1 && std::abs(z - middle) < 0.1 ? 1 : 0;
  }));
  const auto steps = static_cast<int>(std::lround(time / dt));
  for (int step = 0; step < steps; ++step)
    slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == 0);
  const std::vector<double> u =
      slab.read(slab.monodomain->closed_potential(*slab.tissue), static_cast<size_t>(slab.tissue->stride));
  double mass = 0, moment = 0;
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const double s = (p[0] - middle) * n[0] + (p[1] - middle) * n[1] + (p[2] - middle) * n[2];
    mass += u[i];
    moment += u[i] * s * s;
  });
  return moment / mass / (2 * time);
}

TEST(Conductivity, PutsChargeAlongAcrossAndObliqueToTheFibres) {
  // D = sigma / (chi Cm); in the middle of the block the second moment of the stencil is exact.
  constexpr double longitudinal = 0.28, transverse = 0.07, chi_capacitance = 1.4;
  const double D_l = longitudinal / chi_capacitance, D_t = transverse / chi_capacitance;
  const double r2 = std::sqrt(0.5), r3 = std::sqrt(1.0 / 3);
  const std::array<double, 3> x = {1, 0, 0}, y = {0, 1, 0}, xy = {r2, r2, 0}, minus = {r2, -r2, 0},
                              xyz = {r3, r3, r3};
  EXPECT_NEAR(spread(x, x, longitudinal, transverse), D_l, 1e-3 * D_l);
  EXPECT_NEAR(spread(x, y, longitudinal, transverse), D_t, 1e-3 * D_t);
  EXPECT_NEAR(spread(xy, xy, longitudinal, transverse), D_l, 1e-3 * D_l);
  EXPECT_NEAR(spread(xy, minus, longitudinal, transverse), D_t, 1e-3 * D_t);
  EXPECT_NEAR(spread(xy, x, longitudinal, transverse), (D_l + D_t) / 2, 1e-3 * D_l);
  EXPECT_NEAR(spread(xyz, xyz, longitudinal, transverse), D_l, 1e-3 * D_l);
}

// A block under one uniform stimulus and no reaction: the potential is the stimulus's integral.
double lifted(const std::vector<std::pair<std::string, double>>& stimulus, double end, double dt) {
  std::vector<std::pair<std::string, double>> set = {
      {"stimuli.s.radius_mm", 1000}, {ms + "tau_in_ms", 1e12}, {ms + "tau_out_ms", 1e12}};
  for (const auto& [name, value] : stimulus) set.emplace_back("stimuli.s." + name, value);
  Slab slab({8, 1, 1}, 1, Precision::single_, "mitchell_schaeffer", set, {{"s", Stimulus::Kind::sphere, ""}});
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  const auto first = static_cast<int>(std::lround(std::max(0.0, end - 400) / dt));
  for (int step = first; step < std::lround(end / dt); ++step)
    slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == first);
  const std::vector<double> V = slab.potential();
  constexpr double resting = -85;
  for (std::size_t i = 0; i < slab.tissue->regions.size(); ++i)
    if (slab.tissue->regions[i] != 255) return V[i] - resting;
  return 0;
}

TEST(Stimulus, GivesItsAmplitudeTimesItsLength) {
  constexpr double exact = 20 * 1.37;  // neither start nor end lies on a step
  EXPECT_NEAR(lifted({{"start_ms", 0.513}, {"duration_ms", 1.37}, {"amplitude_mV_per_ms", 20}}, 4, 0.05),
              exact, 1e-4 * exact);
}

TEST(Stimulus, RepeatsAndStops) {
  constexpr double exact = 3 * 5 * 2;  // three pulses of 2 ms; a fourth would have come before the end
  EXPECT_NEAR(
      lifted(
          {{"start_ms", 1}, {"duration_ms", 2}, {"period_ms", 10}, {"count", 3}, {"amplitude_mV_per_ms", 5}},
          60, 0.05),
      exact, 1e-4 * exact);
}

TEST(Stimulus, OverlappingPulsesAddUp) {
  constexpr double exact = 4 * 2 * 7;  // four pulses of 7 ms, 2 ms apart
  EXPECT_NEAR(
      lifted(
          {{"start_ms", 1}, {"duration_ms", 7}, {"period_ms", 2}, {"count", 4}, {"amplitude_mV_per_ms", 2}},
          30, 0.05),
      exact, 1e-4 * exact);
}

TEST(Stimulus, S2FollowsTheLastPulse) {
  const std::vector<std::pair<std::string, double>> train = {
      {"start_ms", 1}, {"duration_ms", 2},        {"period_ms", 10},
      {"count", 3},    {"s2_interval_ms", 7.513}, {"amplitude_mV_per_ms", 5}};
  // Pulses at 1, 11, 21 and 28.513 ms, of 10 mV each.
  EXPECT_NEAR(lifted(train, 28.5, 0.05), 3 * 10, 1e-3);
  EXPECT_NEAR(lifted(train, 29.5, 0.05), 3 * 10 + 5 * (29.5 - 28.513), 1e-3);
  EXPECT_NEAR(lifted(train, 60, 0.05), 4 * 10, 1e-3);
  // Without a train it follows the one pulse, whatever `count` says.
  EXPECT_NEAR(lifted({{"duration_ms", 2}, {"count", 4}, {"s2_interval_ms", 20}, {"amplitude_mV_per_ms", 5}},
                     60, 0.05),
              2 * 10, 1e-3);
}

TEST(Stimulus, KeepsItsLengthLate) {
  constexpr double exact = 20 * 2;
  EXPECT_NEAR(lifted({{"start_ms", 99990}, {"duration_ms", 2}, {"amplitude_mV_per_ms", 20}}, 100000, 0.05),
              exact, 1e-3 * exact);
}

// A plane front at a known speed: activation of a probe between centres, interpolated in space and time.
TEST(Probe, ReadsTheFrontBetweenCentres) {
  Scene scene;
  scene.geometry = GeometryKind::box;
  scene.activation.emplace();
  scene.activation->probes = {"a", "b", "end"};
  scene.stimuli = {{"s", Stimulus::Kind::box, ""}};
  declare_parameters(scene);
  const auto set = [&](const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  };
  const double lengths[] = {20, 0.4, 0.4};
  const char* axes[] = {".x", ".y", ".z"};
  for (size_t a = 0; a < 3; ++a) set(std::string("geometry.box.size_mm") + axes[a], lengths[a]);
  set("grid.dx_mm", 0.1);
  set("time.end_ms", 60);
  set("stimuli.s.upper_mm.x", 1);
  constexpr double tau_in = 0.3, tau_out = 6, D = 0.2 / 1.4;  // the defaults
  set("geometry.fibres.direction.x", 1);
  set("outputs.activation.probes.a_mm.x", 8.03);
  set("outputs.activation.probes.b_mm.x", 15.08);
  set("outputs.activation.probes.end_mm.x", 20);
  Member member{0, scene.parameters.values()};
  scene.parameters.resolve(member.values);
  const Plan plan = make_plan(device(), scene, {&member, 1}, {});
  Simulation simulation(device(), scene, plan);
  const Recording recording = simulation.run({&member, 1}, 600)[0];
  ASSERT_EQ(recording.outcome, Outcome::done) << recording.reason;
  const std::vector<std::string> names = layout(scene).features;
  const auto feature = [&](const std::string& name) {
    return static_cast<double>(
        recording.features[static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin())]);
  };
  const double speed = (15.08 - 8.03) / (feature("activation_b_ms") - feature("activation_a_ms"));
  // The gate closes by less than 2 % across the front: the frozen gate's speed holds within 3 %.
  const double root = std::sqrt(1 - 4 * tau_in / tau_out);
  const double exact = std::sqrt(D / (2 * tau_in)) * ((1 + root) / 2 - (1 - root));
  std::printf("speed %.4f mm/ms, frozen gate %.4f; end %.3f ms\n", speed, exact,
              feature("activation_end_ms"));
  EXPECT_NEAR(speed / exact, 1, 0.03);
  // Times have no jumps of a cell (0.3 ms) or of a step: another pair of places, off the centres by other
  // shares, agrees.
  set("outputs.activation.probes.a_mm.x", 8.0);
  set("outputs.activation.probes.b_mm.x", 15.05);
  Member shifted{0, scene.parameters.values()};
  scene.parameters.resolve(shifted.values);
  Simulation again(device(), scene, plan);
  const Recording other = again.run({&shifted, 1}, 600)[0];
  const size_t a =
      static_cast<size_t>(std::find(names.begin(), names.end(), "activation_a_ms") - names.begin());
  EXPECT_NEAR(static_cast<double>(recording.features[a] - other.features[a]), 0.03 / speed, 0.01);
}

}  // namespace
}  // namespace cohort::test
