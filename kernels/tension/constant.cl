// A tension that rises with the activation to a constant and stays: Land et al. 2015, Proc. R. Soc. A 471:20150641, problem 3, whose
// active second Piola-Kirchhoff stress is T f (x) f.
//
//@ states 0
//@ drive none
//@ per_stretch2 0
//@ parameter peak_kPa 60 0 1e4 kPa "active tension" "Land et al. 2015, problem 3"
//@ parameter ramp_ms 0 0 1e6 ms "from activation to the whole of it, smoothly; 0: at once" "chosen"

real tension_step(real *state, real since_activation_ms, real beat_ms, real drive, real stretch, real stretch_rate, real dt_ms,
                  global const real *M) {
  if (since_activation_ms < 0) return 0;
  const real ramp = M[M_ramp_ms];
  return M[M_peak_kPa] * (ramp > 0 ? smoothstep(R(0.0), ramp, since_activation_ms) : R(1.0));
}

real tension_stiffness(const real *state, real tension, real stretch, global const real *M) { return 0; }
