// Nash & Panfilov 2004, Prog. Biophys. Mol. Biol. 85:501, eqs. 22c, 23: tension that follows the potential,
//   dT/dt = e(V) (kT V - T), V normalised to 0 at rest and 1 at the peak,
// where e is one rate below V = 0.05 and ten times that above. Goektepe & Kuhl 2010, Comput. Mech. 45:227, eq. 47, make the switch smooth:
//   e = e_rest + (e_excited - e_rest) exp(-exp(-steepness (V - threshold))), their steepness 1/mV, which is 100 here.
// The paper gives rates in its own unit of time, 12.9 ms, and tension then copies the potential within 2 ms. Its public implementation in Chaste
// (Nash2004ContractionModel) takes a unit of 100 ms therefore; so do the defaults: 10 ms up, 100 ms down. Sources disagree on which side of the
// threshold is fast (the paper's CellML file has it the other way round), so both times are parameters.
// The paper has no dependence on length or velocity. The first is that of Hunter, McCulloch & ter Keurs 1998, 1 + beta (lambda - 1), which
// leaves the paper's tension at lambda = 1; the second is off, since kT was adjusted to a shortening without it.
//
//@ states 2
//@ drive potential
//@ per_stretch2 1
//@ parameter peak_kPa 47.9 0 1e4 kPa "tension that V = 1 leads to, kT" "Nash & Panfilov 2004, table 1"
//@ parameter rise_ms 10 0.1 1e4 ms "time constant while excited" "Nash & Panfilov 2004, eq. 23, unit of time as in Chaste"
//@ parameter decay_ms 100 0.1 1e4 ms "time constant at rest" "Nash & Panfilov 2004, eq. 23, unit of time as in Chaste"
//@ parameter threshold 0.05 -1 2 1 "normalised potential at which the rate changes" "Nash & Panfilov 2004, eq. 23"
//@ parameter steepness 100 0.1 1e4 1 "of that change" "Goektepe & Kuhl 2010, figure 3"
//@ parameter rest_mV -80 -200 200 mV "potential of V = 0" "Nash & Panfilov 2004 (with Aliev & Panfilov 1996)"
//@ parameter range_mV 100 1 400 mV "potential of V = 1 above that" "Nash & Panfilov 2004 (with Aliev & Panfilov 1996)"
//@ parameter length_slope 1.45 0 50 1 "relative growth of tension with stretch" "Hunter, McCulloch & ter Keurs 1998, beta_0"
//@ parameter shortening_per_ms 0 0 1 1/ms "rate of unloaded shortening; 0: tension does not depend on velocity" "off, as in the paper"
//@ parameter hill_a 0.35 0.01 10 1 "curvature of the force-velocity curve" "Niederer, Hunter & Smith 2006"
//@ parameter velocity_lag_ms 10 0.1 1000 ms "how long tension lags behind velocity" "chosen: kernels/README.md"

real tension_step(real *state, real since_activation_ms, real beat_ms, real drive, real stretch, real stretch_rate, real dt_ms,
                  global const real *M) {
  const real velocity =
      lagging_force_velocity(state + 1, stretch_rate, M[M_shortening_per_ms], M[M_hill_a], M[M_velocity_lag_ms], dt_ms);
  const real V = (drive - M[M_rest_mV]) / M[M_range_mV];
  const real switched = exp(-exp(clamp(-M[M_steepness] * (V - M[M_threshold]), R(-80.0), R(80.0))));
  const real rest = 1 / M[M_decay_ms], rate = rest + (1 / M[M_rise_ms] - rest) * switched;
  state[0] += (M[M_peak_kPa] * fmax(V, R(0.0)) - state[0]) * way(rate, dt_ms);
  return state[0] * fmax(1 + M[M_length_slope] * (stretch - 1), R(0.0)) * velocity;
}

real tension_stiffness(const real *state, real tension, real stretch, global const real *M) {
  const real velocity = force_velocity(state[1], M[M_shortening_per_ms], M[M_hill_a]);
  return TENSION_SLOPE(state[0] * M[M_length_slope] * velocity +
                           force_velocity_stiffness(tension, M[M_shortening_per_ms], M[M_hill_a], M[M_velocity_lag_ms]),
                       stretch);
}
