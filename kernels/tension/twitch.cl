// A twitch that time since activation prescribes, with length dependence (Kerckhoffs et al. 2003, Ann. Biomed. Eng. 31:536, in form):
//   T = peak tanh^2(t / rise) tanh^2((duration - t) / decay) max(0, tanh(length_slope (lambda - length_zero)))
// It goes on over the end of a beat, and where a beat is shorter than it the twitch is as short as the beat: cut at a beat of
// 400 ms it let the pressure fall by 24,000 mmHg/s. Force depends on velocity only where shortening_per_ms is set: peak and times
// were found without, and at a shortening of 1/s with 5/s unloaded Hill's curve leaves half of the tension.
//
//@ states 1
//@ drive none
//@ per_stretch2 1
//@ parameter peak_kPa 205 0 1e4 kPa "tension of the longest fibres" "chosen: gives physiological loops with the default heart"
//@ parameter rise_ms 58 0.1 1e4 ms "time constant of the rise" "chosen: gives physiological loops with the default heart"
//@ parameter decay_ms 35 0.1 1e4 ms "time constant of the fall" "chosen: gives physiological loops with the default heart"
//@ parameter duration_ms 430 1 1e4 ms "from activation to the end, at most a beat" "chosen: gives physiological loops with the default heart"
//@ parameter length_slope 2 0 50 1 "how steeply tension grows with stretch" "chosen: gives physiological loops with the default heart"
//@ parameter length_zero 0.7 0 2 1 "stretch at which no tension is left" "chosen: gives physiological loops with the default heart"
//@ parameter shortening_per_ms 0 0 1 1/ms "rate of unloaded shortening; 0: tension does not depend on velocity" "off: peak and times were found without"
//@ parameter hill_a 0.35 0.01 10 1 "curvature of the force-velocity curve" "Niederer, Hunter & Smith 2006"
//@ parameter velocity_lag_ms 10 0.1 1000 ms "how long tension lags behind velocity" "chosen: kernels/README.md"

real tension_step(real *state, real since_activation_ms, real beat_ms, real drive, real stretch, real stretch_rate, real dt_ms,
                  global const real *M) {
  const real velocity = !(M[M_shortening_per_ms] > 0) ? R(1.0) :
      lagging_force_velocity(state, stretch_rate, M[M_shortening_per_ms], M[M_hill_a], M[M_velocity_lag_ms], dt_ms);
  const real duration = fmin(M[M_duration_ms], beat_ms), t = clamp(since_activation_ms, R(0.0), duration);
  if (!(t > 0 && t < duration)) return 0;
  const real rise = tanh(t / M[M_rise_ms]), fall = tanh((duration - t) / M[M_decay_ms]);
  const real length = fmax(tanh(M[M_length_slope] * (stretch - M[M_length_zero])), R(0.0));
  return M[M_peak_kPa] * rise * rise * fall * fall * length * velocity;
}

real tension_stiffness(const real *state, real tension, real stretch, global const real *M) {
  const real slope = M[M_length_slope], length = tanh(slope * (stretch - M[M_length_zero]));
  const real by_length = length > R(1e-3) ? tension * slope * (1 / length - length) : R(0.0);
  return TENSION_SLOPE(by_length + force_velocity_stiffness(tension, M[M_shortening_per_ms], M[M_hill_a], M[M_velocity_lag_ms]),
                       stretch);
}
