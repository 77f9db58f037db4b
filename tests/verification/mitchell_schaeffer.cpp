// Single cell: action potential durations of the full equations, tests/reference/mitchell_schaeffer.yaml.
#include <cmath>
#include <cstdio>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

// Time from a kick to v = 0.5 with gate h until v falls through v_gate, linear in the last step; ms.
double duration(double h, double dt) {
  Slab cell({8, 1, 1}, 1, Precision::double_, "mitchell_schaeffer", {});
  cell.monodomain->initialise(*cell.tissue, cell.parameters, dt, 1);
  constexpr double resting = -85, amplitude = 105, v_gate = 0.13;
  cell.write(cell.monodomain->potential(),
             cell.field([](auto...) { return resting + 0.5 * amplitude; }, resting));
  cell.write(cell.monodomain->states(), cell.field([&](auto...) { return h; }, 1));
  double previous = 0.5;
  for (int step = 0; step * dt < 600; ++step) {
    cell.monodomain->advance(*cell.tissue, cell.parameters, step * dt, step == 0);
    const std::vector<double> all = cell.potential();
    double v = 0;
    cell.each_cell([&](std::size_t i, const auto&) { v = (all[i] - resting) / amplitude; });
    if (v < v_gate && previous >= v_gate) return (step + (previous - v_gate) / (previous - v)) * dt;
    previous = v;
  }
  return -1;
}

TEST(MitchellSchaeffer, DurationsFollowTheRestitutionCurve) {
  constexpr double tau_in = 0.3, tau_out = 6, tau_open = 120, tau_close = 150, dt = 0.05;
  constexpr double h_min = 4 * tau_in / tau_out;
  const auto gate = [&](double interval) { return 1 - (1 - h_min) * std::exp(-interval / tau_open); };
  const auto leading_order = [&](double interval) { return tau_close * std::log(gate(interval) / h_min); };
  // The full equations give the leading order plus 43.27 ms at every diastolic interval.
  constexpr double full_minus_leading_order = 43.27, longest = 284.69;
  EXPECT_NEAR(duration(1.0, dt), longest, 0.1);
  for (const double interval : {50.0, 100.0, 200.0, 400.0}) {
    const double measured = duration(gate(interval), dt);
    std::printf("DI %5.0f ms  APD %.3f ms  leading order + 43.27: %.3f\n", interval, measured,
                leading_order(interval) + full_minus_leading_order);
    EXPECT_NEAR(measured - leading_order(interval), full_minus_leading_order, 0.1) << interval;
    EXPECT_NEAR(measured - duration(1.0, dt), leading_order(interval) - leading_order(1e9), 0.1) << interval;
  }
}

}  // namespace
}  // namespace cohort::test
