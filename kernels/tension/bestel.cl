// Tension prescribed by time: Bestel, Clement & Sorine 2001, as in Arostica et al. 2025, Comput. Methods Appl. Mech. Eng. 435:117485:
//   dT/dt = -|a| T + peak max(a, 0),  a = a_max f + a_min (1 - f),  f = S+(t - systole) S-(t - diastole),
//   S+-(x) = (1 +- tanh(x / width)) / 2, and active second Piola-Kirchhoff stress T f (x) f.
// The benchmark's ventricular pressure follows the same equation with terms for the filling: bestel_pressure_step.
//
//@ states 1
//@ drive none
//@ per_stretch2 0
//@ parameter peak_kPa 150 0 1e4 kPa "tension that the contraction leads to" "Arostica et al. 2025"
//@ parameter a_max_per_ms 0.005 1e-6 1 1/ms "rate of the rise" "Arostica et al. 2025"
//@ parameter a_min_per_ms -0.03 -1 0 1/ms "rate of the fall, negative" "Arostica et al. 2025"
//@ parameter systole_ms 160 0 1e5 ms "when contraction begins" "Arostica et al. 2025"
//@ parameter diastole_ms 484 0 1e5 ms "when relaxation begins" "Arostica et al. 2025"
//@ parameter width_ms 5 0.01 1000 ms "of both changes" "Arostica et al. 2025"
//@ parameter pressure_systole_ms 170 0 1e5 ms "when the pressure of contraction begins" "Arostica et al. 2025"
//@ parameter pressure_filling_per_ms 0.005 0 1 1/ms "rate of the pressure in diastole, alpha_pre" "Arostica et al. 2025"
//@ parameter pressure_base_per_ms 0.001 0 1 1/ms "rate of the pressure at all times, alpha_mid" "Arostica et al. 2025"
//@ parameter pressure_filling_kPa_per_ms 0.007 0 10 kPa/ms "rise of the pressure by filling, s_pre" "Arostica et al. 2025"
//@ parameter pressure_peak_kPa 16 0 1e4 kPa "pressure that contraction leads to, s_mid" "Arostica et al. 2025"

/// a at time t, for a contraction that begins at `systole`.
static inline real bestel_rate(real t, real systole, global const real *M) {
  const real width = M[M_width_ms];
  const real f = R(0.25) * (1 + tanh((t - systole) / width)) * (1 - tanh((t - M[M_diastole_ms]) / width));
  return M[M_a_max_per_ms] * f + M[M_a_min_per_ms] * (1 - f);
}

// y' = -|a| y + source over dt, both constant: exact.
static inline real bestel_way(real y, real a, real source, real dt) {
  const real z = fabs(a) * dt;
  const real part = z > R(1e-4) ? -expm1(-z) / z : 1 - R(0.5) * z;
  return y + part * dt * (source - fabs(a) * y);
}

// Rates at the middle of the step: second order.
real tension_step(real *state, real since_activation_ms, real beat_ms, real drive, real stretch, real stretch_rate, real dt_ms,
                  global const real *M) {
  if (since_activation_ms <= 0) return state[0];
  const real a = bestel_rate(since_activation_ms - R(0.5) * dt_ms, M[M_systole_ms], M);
  state[0] = bestel_way(state[0], a, M[M_peak_kPa] * fmax(a, R(0.0)), dt_ms);
  return state[0];
}

real tension_stiffness(const real *state, real tension, real stretch, global const real *M) { return 0; }

/// Pressure at time_ms from that at time_ms - dt_ms, kPa:
///   p' = -|b| p + s_mid max(b, 0) + s_pre max(g, 0),  b = a + alpha_pre g + alpha_mid,  g = S-(t - diastole).
real bestel_pressure_step(real pressure, real time_ms, real dt_ms, global const real *M) {
  const real t = time_ms - R(0.5) * dt_ms, g = R(0.5) * (1 - tanh((t - M[M_diastole_ms]) / M[M_width_ms]));
  const real b = bestel_rate(t, M[M_pressure_systole_ms], M) + M[M_pressure_filling_per_ms] * g + M[M_pressure_base_per_ms];
  return bestel_way(pressure, b, M[M_pressure_peak_kPa] * fmax(b, R(0.0)) + M[M_pressure_filling_kPa_per_ms] * g, dt_ms);
}
