// Mitchell & Schaeffer 2003, Bull. Math. Biol. 65:767, doi 10.1016/S0092-8240(03)00041-7, equations (1) to (4):
//     dv/dt = h v^2 (1 - v) / tau_in - v / tau_out + J_stim,   v = (V - V_rest) / amplitude
//     dh/dt = (1 - h) / tau_open where v < v_gate, -h / tau_close elsewhere.
// A cell model is one file: the lines //@ declare it to the host, the functions below are what the kernels call.
//
//@ parameter tau_in_ms 0.3 0.05 5 ms "time constant of depolarisation" "Mitchell & Schaeffer 2003"
//@ parameter tau_out_ms 6 1 50 ms "time constant of repolarisation" "Mitchell & Schaeffer 2003"
//@ parameter tau_open_ms 120 5 1000 ms "time constant of the gate's recovery" "Mitchell & Schaeffer 2003"
//@ parameter tau_close_ms 150 5 1000 ms "time constant of the gate's closing; sets the action potential's duration" "Mitchell & Schaeffer 2003"
//@ parameter v_gate 0.13 0.01 0.5 1 "potential at which the gate changes direction" "Mitchell & Schaeffer 2003"
//@ parameter resting_mV -85 -120 0 mV "transmembrane potential at v = 0" "usual ventricular resting potential"
//@ parameter amplitude_mV 105 1 200 mV "transmembrane potential difference between v = 0 and v = 1" "usual ventricular amplitude"
//@ rest resting_mV
//@ potential -1 2 amplitude_mV
//@ state h 1 0 1
//@ derived inverse_tau_in tau_in_ms
//@ derived inverse_tau_out tau_out_ms
//@ derived open_share tau_open_ms
//@ derived close_share tau_close_ms
//@ derived gate v_gate
//@ derived resting resting_mV
//@ derived inverse_amplitude amplitude_mV
//@ derived amplitude amplitude_mV

// Constants of one cell from its parameters, for steps of dt ms.
void cell_derive(const real *p, real dt, real *d) {
  d[D_inverse_tau_in] = 1 / p[P_tau_in_ms];
  d[D_inverse_tau_out] = 1 / p[P_tau_out_ms];
  d[D_open_share] = -expm1(-dt / p[P_tau_open_ms]);
  d[D_close_share] = -expm1(-dt / p[P_tau_close_ms]);
  d[D_gate] = p[P_v_gate];
  d[D_resting] = p[P_resting_mV];
  d[D_inverse_amplitude] = 1 / p[P_amplitude_mV];
  d[D_amplitude] = p[P_amplitude_mV];
}

// Fastest rate of the model in 1/ms, a bound of |d(dv/dt)/dv|: the cubic's slope is at most 1/tau_in in [0, 1].
real cell_fastest_rate(const real *p) { return 1 / p[P_tau_in_ms] + 1 / p[P_tau_out_ms]; }

// One step of dt ms: midpoint rule for V, the gate by its exact exponential (Rush & Larsen 1978) with the direction
// that the midpoint's potential sets. stimulus in mV/ms. Second order in dt between switches of the gate. By the share of the
// way that the gate goes: a factor near 1 is rounded the same way in every step (0.1 ms of APD90 at 0.01 ms in single precision).
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  const realv v = (*V - d[D_resting]) * d[D_inverse_amplitude];
  const realv h = state[S_h];
  const realv drive = stimulus * d[D_inverse_amplitude];
  const realv slope = fma(v, fma(h * d[D_inverse_tau_in] * v, 1 - v, -d[D_inverse_tau_out]), drive);
  const realv middle = fma(R(0.5) * dt, slope, v);
  const realv opening = fma(1 - h, d[D_open_share], h);
  const realv closing = fma(-h, d[D_close_share], h);
  const realv h_end = WHERE(isless(middle, d[D_gate]), opening, closing);
  const realv h_middle = R(0.5) * (h + h_end);
  const realv slope_middle =
      fma(middle, fma(h_middle * d[D_inverse_tau_in] * middle, 1 - middle, -d[D_inverse_tau_out]), drive);
  *V = fma(d[D_amplitude] * dt, slope_middle, *V);
  state[S_h] = h_end;
}
