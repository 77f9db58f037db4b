// Chambers of tissue and the circulation, with the simplest tissue there is: pistons. Two chambers share a
// septum, so that V_lv = A x1 + B x1^2 + S x3 and V_rv = A x2 + B x2^2 - S x3 with masses at x1, x2, x3;
// walls are springs that stiffen and contract. The step is that of a solid: explicit, with the pressures
// found so that cavities take the blood they get.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "solver/circulation.hpp"
#include "solver/lumped_circulation.hpp"
#include "solver/pv_output.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

enum Scheme { constraint, penalty, late_pressure };

const char* const pistons = R"(
constant double A = 3000, B = 2, S = 1000;              // mm2, mm, mm2
constant double mass[3] = {1000, 1000, 400};            // mg, as of the nodes around a cavity
constant double passive[2] = {0.8, 0.4}, active[2] = {3, 0.7};  // mmHg, mmHg/mL
constant double first_volume[2] = {127, 129};           // mL, with the walls' pressures

double wall_mmHg(int q, double mL, double ms) {
  const double rise = tanh(ms / 65), fall = tanh(fmax(425 - ms, 0.) / 40);
  return passive[q] * (exp((mL - 60) / 28) - 1) + active[q] * rise * rise * fall * fall * (mL - 20);
}
double volume_of(int q, global const double *x) { return A * x[q] + B * x[q] * x[q] + (q == 0 ? S : -S) * x[2]; }

// Filled to the volumes of the start; member m has x and v, and the pressures of its last step, in 8 numbers.
kernel void fill_pistons(global const real *P, global heart_state *states, global const double *numbers, global double *p,
                         const double K) {
  const int m = get_global_id(0);
  const loop_parameters a = load_loop(P + m * PARAMETERS, numbers[0]);
  heart_state h = states[m];
  global double *x = p + 8 * m;
  for (int q = 0; q < 2; ++q) {
    const double V = first_volume[q] * 1000;
    x[q] = (-A + sqrt(A * A + 4 * B * V)) / (2 * B);
    x[6 + q] = wall_mmHg(q, first_volume[q], 0) / MMHG_PER_KPA;
    attach_cavity(&h.loop, q, K > 0 ? V * (1 + x[6 + q] / K) : V, x[6 + q]);
  }
  for (int k = 2; k < 6; ++k) x[k] = 0;
  begin_heart(&a, &h);
  states[m] = h;
}

kernel void beat_pistons(global const real *P, global heart_state *states, global heart_status *status,
                         global const double *numbers, global float *pressure, global float *volume, const int at_most,
                         const int samples, global double *p, const int scheme, const double dt_ms, const double K, const int steps) {
  const int m = get_global_id(0);
  const loop_parameters a = load_loop(P + m * PARAMETERS, numbers[0]);
  const heart_clock c = load_clock(numbers, at_most, samples);
  heart_state h = states[m];
  global double *x = p + 8 * m, *v = x + 3, *last = x + 6;
  for (int n = 0; n < steps && h.ended == RUNNING; ++n) {
    const double dt = clipped_step(&c, &h, dt_ms);
    double g[2][3], free_v[3];
    cavities tissue;
    for (int q = 0; q < 2; ++q) {
      for (int k = 0; k < 3; ++k) g[q][k] = k == q ? A + 2 * B * x[k] : k == 2 ? (q == 0 ? S : -S) : 0;
      tissue.volume[q] = volume_of(q, x);
    }
    for (int k = 0; k < 3; ++k) {
      double force = k == 2 ? -20. * x[2] : 0;  // the septum's own spring, mN/mm
      for (int q = 0; q < 2; ++q) force -= g[q][k] * wall_mmHg(q, tissue.volume[q] / 1000, h.time) / MMHG_PER_KPA;
      free_v[k] = (v[k] + dt * force / mass[k]) / (1 + 0.02 * dt);
    }
    for (int q = 0; q < 2; ++q) {
      tissue.rate[q] = 0;
      for (int k = 0; k < 3; ++k) tissue.rate[q] += g[q][k] * free_v[k];
      for (int r = 0; r < 2; ++r) {
        tissue.compliance[q][r] = 0;
        for (int k = 0; k < 3; ++k) tissue.compliance[q][r] += g[q][k] * g[r][k] / mass[k];
      }
    }
    if (scheme == 1)  // p = K (V0D - V3D) / V at the step's end, in the terms of the constraint
      for (int q = 0; q < 2; ++q) {
        tissue.rate[q] = 0.8 * (tissue.volume[q] - h.loop.volume[q] * 1000) / dt;
        for (int r = 0; r < 2; ++r) tissue.compliance[q][r] = q == r ? tissue.volume[q] / (K * dt * dt) : 0;
      }
    advance_heart(&a, &c, &h, &tissue, dt_ms, pressure + m * COMPARTMENTS * samples, volume + m * COMPARTMENTS * samples);
    for (int q = 0; q < 2; ++q) {
      const double now = h.loop.pressure[q] / MMHG_PER_KPA, acts = scheme == 2 ? last[q] : now;
      last[q] = now;
      for (int k = 0; k < 3; ++k) free_v[k] += dt * g[q][k] * acts / mass[k];
    }
    for (int k = 0; k < 3; ++k) {
      v[k] = free_v[k];
      x[k] += dt * v[k];
    }
  }
  states[m] = h;
  status[m] = status_of(&h);
}
)";

// One step from a random state with random cavities; by how much flows miss the law of the valves, and
// pressures that of the cavities, relative to the largest flow.
const char* const random_steps = R"(
double number(uint *seed, double lower, double upper) {
  *seed = *seed * 1664525u + 1013904223u;
  return lower + (upper - lower) * (*seed / 4294967296.);
}
kernel void step_at_random(global const real *P, global double *misses) {
  const int m = get_global_id(0);
  uint seed = 12345u + 7919u * m;
  for (int k = 0; k < 10; ++k) number(&seed, 0, 1);
  loop_parameters a = load_loop(P, 800);
  for (int v = 0; v < VALVES; ++v) {
    a.open[v] = pow(10, number(&seed, -4, 0));
    a.closed[v] = a.open[v] * pow(10, number(&seed, 0.1, 9));
  }
  a.opening = m % 2 ? number(&seed, 0, 2) : 0;
  for (int k = 0; k < 4; ++k) {
    a.compliance[k] = pow(10, number(&seed, -2, 2));
    a.inertance[k] = pow(10, number(&seed, -5, -1));
  }
  loop_state s;
  for (int i = 0; i < NODES; ++i) {
    s.volume[i] = i < CHAMBERS ? number(&seed, 10, 200) : a.compliance[i - CHAMBERS] * number(&seed, -10, 150);
    s.lost[i] = s.pressure[i] = 0;
  }
  for (int e = 0; e < EDGES; ++e) s.flow[e] = number(&seed, -500, 500);
  s.open = m % 16;
  cavities tissue;
  const double dt = pow(10, number(&seed, -6, -3)), own = number(&seed, 1, 3) * 1e4;
  for (int q = 0; q < CHAMBERS; ++q) {
    tissue.rate[q] = number(&seed, -500, 500);
    tissue.volume[q] = s.volume[q] * 1000 + number(&seed, -1, 1);
    for (int r = 0; r < CHAMBERS; ++r) tissue.compliance[q][r] = q == r ? own : -0.9 * own * number(&seed, 0, 1);
  }
  tissue.compliance[1][0] = tissue.compliance[0][1];
  double before[CHAMBERS];
  for (int q = 0; q < CHAMBERS; ++q) before[q] = s.volume[q];
  step_with_tissue(&a, &s, &tissue, 0.3, dt);
  double scale = 1, miss = 0;
  for (int e = 0; e < EDGES; ++e) scale = fmax(scale, fabs(s.flow[e]));
  for (int v = 0; v < VALVES; ++v) {
    const double d = s.pressure[edge_from[v]] - s.pressure[edge_to[v]];
    miss = fmax(miss, fabs(s.flow[v] - fmax(d / a.closed[v], (d - a.opening) / a.open[v])));
  }
  for (int q = 0; q < 2; ++q) {
    double sum = tissue.rate[q] - (before[q] - tissue.volume[q] / 1000) / (5 * dt);
    for (int r = 0; r < 2; ++r) sum += dt * 1000 * tissue.compliance[q][r] * s.pressure[r] / MMHG_PER_KPA;
    const double in = q == 0 ? s.flow[MITRAL] - s.flow[AORTIC] : s.flow[TRICUSPID] - s.flow[PULMONARY];
    miss = fmax(miss, fabs(sum - in));
  }
  misses[m] = miss / scale;
}
)";

struct Hearts {
  /// peripheral: systemic arterial resistance of each member, mmHg s/mL.
  Hearts(Scheme scheme, double dt_ms, const std::vector<double>& peripheral = {0.733}, double K = 0,
         int beats = 3)
      : launcher(device(), Precision::double_) {
    scene.geometry = GeometryKind::none;
    scene.precision = Precision::double_;
    scene.pv.emplace();
    scene.circulation.emplace();
    scene.beats.emplace();
    scene.mechanics.emplace();
    scene.mechanics->cavities = {{"lv", ""}, {"rv", ""}};
    scene.parameters.add({"time.step_factor", "1", 1, 0.25, 4, "", ""});  // the circulation's tables know it
    declare_circulation(scene);
    declare_pv_outputs(scene);
    scene.parameters[scene.parameters.index("time.beats.until_periodic")].value = 0;
    scene.parameters[scene.parameters.index("time.beats.at_most")].value = beats;
    std::vector<double> values;
    for (const double resistance : peripheral) {
      std::vector<double> own = scene.parameters.values();
      own[static_cast<std::size_t>(
          scene.parameters.index("circulation.systemic.arterial_resistance_mmHg_s_per_mL"))] = resistance;
      scene.parameters.resolve(own);
      values.insert(values.end(), own.begin(), own.end());
    }
    const std::vector<std::byte> packed = pack(values, scene.precision);
    const cl::Buffer parameters = device().allocate(packed.size());
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    const std::size_t samples = pv_times_ms(scene).size(), members = peripheral.size();
    LumpedCirculation circulation(launcher, scene, static_cast<int>(members), samples);
    circulation.initialise(parameters, static_cast<int>(members));
    const cl::Program program =
        device().build({"circulation.clh", "beats.clh", pistons},
                       {"DOUBLE", "PARAMETERS=" + std::to_string(scene.parameters.size())},
                       circulation_tables(scene, false));
    Launcher::Handle fill = launcher.handle(program, "fill_pistons"),
                     beat = launcher.handle(program, "beat_pistons");
    const cl::Buffer state = device().allocate(members * 8 * sizeof(double));
    launcher(fill, cl::NDRange(members), cl::NDRange(1), 0, parameters, circulation.states(),
             circulation.clock(), state, Real{K});
    blood_before = circulation.blood();
    do {
      constexpr int steps = 1000;
      launcher(beat, cl::NDRange(members), cl::NDRange(1), 0, parameters, circulation.states(),
               circulation.statuses(), circulation.clock(), circulation.pressure_buffer(),
               circulation.volume_buffer(), circulation.at_most(), static_cast<int>(samples), state,
               static_cast<int>(scheme), Real{dt_ms}, Real{K}, steps);
      status = circulation.status();
    } while (std::any_of(status.begin(), status.end(),
                         [](const HeartStatus& s) { return s.ended == HeartEnd::running; }));
    blood_after = circulation.blood();
    pressure = circulation.pressure();
    volume = circulation.volume();
  }
  double drift() const {
    double most = 0;
    for (std::size_t m = 0; m < status.size(); ++m)
      most = std::max(most, std::abs(blood_after[m] / blood_before[m] - 1));
    return most;
  }
  void print(const char* name) const {
    const auto lv = std::span(volume).first(800), p = std::span(pressure).first(800),
               rv = std::span(volume).subspan(800, 800);
    const auto range = [](std::span<const float> row) {
      const auto [least, most] = std::minmax_element(row.begin(), row.end());
      return std::pair(*least, *most);
    };
    std::printf(
        "%-12s LV %.2f to %.2f mL, peak %.2f mmHg, RV %.2f to %.2f mL; ringing %.4f mmHg, switches %d, apart "
        "%.2e "
        "mL, steepest %.0f mmHg/s, drift %.1e\n",
        name, range(lv).first, range(lv).second, range(p).second, range(rv).first, range(rv).second,
        status[0].ringing_mmHg, status[0].switches, status[0].apart_mL, status[0].steepest_mmHg_per_s,
        drift());
    if (status[0].ended == HeartEnd::unstable)
      std::printf("             %.2f ms: %s\n", status[0].ended_ms, instability(scene, status[0]).c_str());
  }

  Scene scene;
  Launcher launcher;
  std::vector<HeartStatus> status;
  std::vector<double> blood_before, blood_after;
  std::vector<float> pressure, volume;
};

TEST(Coupling, StepsSolveTheirEquationsFromAnyState) {
  const Hearts hearts(constraint, 0.5, {0.733}, 0, 1);
  std::vector<double> values = hearts.scene.parameters.values();
  hearts.scene.parameters.resolve(values);
  Launcher launcher(device(), Precision::double_);
  const std::vector<std::byte> packed = pack(values, Precision::double_);
  constexpr std::size_t states = 100000;
  const cl::Buffer parameters = device().allocate(packed.size()),
                   misses = device().allocate(states * sizeof(double));
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
  const cl::Program program =
      device().build({"circulation.clh", random_steps},
                     {"DOUBLE", "PARAMETERS=" + std::to_string(hearts.scene.parameters.size())},
                     circulation_tables(hearts.scene, false));
  Launcher::Handle step = launcher.handle(program, "step_at_random");
  launcher(step, cl::NDRange(states), cl::NDRange(1), 0, parameters, misses);
  std::vector<double> miss(states);
  launcher.queue().enqueueReadBuffer(misses, CL_TRUE, 0, states * sizeof(double), miss.data());
  for (const double m : miss) ASSERT_TRUE(std::isfinite(m));
  std::printf("largest miss %.2e\n", *std::max_element(miss.begin(), miss.end()));
  EXPECT_LT(*std::max_element(miss.begin(), miss.end()), 1e-9);
}

TEST(Coupling, PistonsBeatWithoutRinging) {
  const Hearts hearts(constraint, 0.08);
  hearts.print("constraint");
  EXPECT_EQ(hearts.status[0].ended, HeartEnd::done) << instability(hearts.scene, hearts.status[0]);
  EXPECT_LE(hearts.status[0].switches, 10);
  EXPECT_GE(hearts.status[0].switches, 8);
  EXPECT_LT(hearts.status[0].ringing_mmHg, 0.1);
  EXPECT_LT(hearts.status[0].apart_mL, 1e-3);
  EXPECT_LT(hearts.drift(), 1e-12);
}

TEST(Coupling, StepsConverge) {
  const Hearts coarse(constraint, 0.16), middle(constraint, 0.08), fine(constraint, 0.04),
      finest(constraint, 0.02);
  const auto error = [&](const Hearts& hearts) {
    double sum = 0;
    for (std::size_t i = 0; i < hearts.pressure.size(); ++i)
      sum += std::pow(hearts.pressure[i] - finest.pressure[i], 2) +
             std::pow(hearts.volume[i] - finest.volume[i], 2);
    return std::sqrt(sum / static_cast<double>(2 * hearts.pressure.size()));
  };
  const double a = error(coarse), b = error(middle), c = error(fine);
  std::printf("RMS from 0.02 ms: 0.16 ms %.3e, 0.08 ms %.3e, 0.04 ms %.3e\n", a, b, c);
  // First order: differences from a quarter, half and twice the finest step are as 7 : 3 : 1.
  EXPECT_GT(a / b, 7. / 3 * 0.85);
  EXPECT_GT(b / c, 3 * 0.85);
}

TEST(Coupling, PenaltyBeyondItsLimitIsNamed) {
  // K < 4 V / (dt^2 g M^-1 g); at the start g = (A + 2 B x1, S).
  constexpr double dt = 0.08, V = 127e3, g2 = 3000. * 3000 + 8 * V;
  constexpr double limit = 4 * V / (dt * dt * (g2 / 1e3 + 1e6 / 400));
  const Hearts beyond(penalty, dt, {0.733}, 1.5 * limit);
  beyond.print("penalty 1.5");
  ASSERT_EQ(beyond.status[0].ended, HeartEnd::unstable);
  EXPECT_NE(instability(beyond.scene, beyond.status[0]).find("coupling oscillation"), std::string::npos);
  EXPECT_GT(beyond.status[0].ended_ms, 0);
  EXPECT_LT(beyond.status[0].ended_ms, 800);
  EXPECT_LT(beyond.drift(), 1e-12);  // no sum tells
}

TEST(Coupling, PressureOneStepLateIsNamed) {
  const Hearts late(late_pressure, 0.08);
  late.print("late");
  ASSERT_EQ(late.status[0].ended, HeartEnd::unstable);
  EXPECT_NE(instability(late.scene, late.status[0]).find("coupling oscillation"), std::string::npos);
  EXPECT_LT(late.status[0].ended_ms, 800);
}

TEST(Coupling, MembersDoNotSeeEachOther) {
  const Hearts together(constraint, 0.08, {0.5, 0.733, 2}), alone(constraint, 0.08, {0.733});
  const std::size_t row = alone.pressure.size();
  for (const HeartStatus& status : together.status)
    EXPECT_EQ(status.ended, HeartEnd::done) << instability(together.scene, status);
  EXPECT_TRUE(std::equal(alone.pressure.begin(), alone.pressure.end(),
                         together.pressure.begin() + static_cast<long>(row)));
  EXPECT_TRUE(
      std::equal(alone.volume.begin(), alone.volume.end(), together.volume.begin() + static_cast<long>(row)));
  EXPECT_NE(together.pressure[100], together.pressure[row + 100]);
}

}  // namespace
}  // namespace cohort::test
