// FitzHugh & Nagumo's model (FitzHugh 1961, Biophys. J. 1:445) in the cardiac form of Rogers & McCulloch 1994, IEEE Trans. Biomed.
// Eng. 41:743, doi 10.1109/10.310090, time in ms:
//     du/dt = c1 u (u - a) (1 - u) - c2 u v + J_stim,   dv/dt = b (u - d v),   u = (V - V_rest) / amplitude
// A cell model is one file: the lines //@ declare it to the host, the functions below are what the kernels call.
//
//@ parameter a 0.13 0.001 0.49 1 "threshold of excitation" "Rogers & McCulloch 1994"
//@ parameter b_per_ms 0.013 0 0.5 1/ms "rate of recovery" "Rogers & McCulloch 1994"
//@ parameter c1_per_ms 0.26 0.01 20 1/ms "size of the cubic current" "Rogers & McCulloch 1994"
//@ parameter c2_per_ms 0.1 0 10 1/ms "size of the recovery current" "Rogers & McCulloch 1994"
//@ parameter d 1 0.05 20 1 "potential at which v = 1 rests" "Rogers & McCulloch 1994"
//@ parameter resting_mV -85 -120 0 mV "transmembrane potential at u = 0" "usual ventricular resting potential"
//@ parameter amplitude_mV 125 1 200 mV "transmembrane potential difference between u = 0 and u = 1" "usual ventricular amplitude"
//@ rest resting_mV
//@ potential -1 2 amplitude_mV
//@ state v 0
//@ derived a a
//@ derived c1 c1_per_ms
//@ derived c2 c2_per_ms
//@ derived share b_per_ms d
//@ derived inverse_d d
//@ derived resting resting_mV
//@ derived amplitude amplitude_mV
//@ derived inverse_amplitude amplitude_mV

void cell_derive(const real *p, real dt, real *d) {
  d[D_a] = p[P_a];
  d[D_c1] = p[P_c1_per_ms];
  d[D_c2] = p[P_c2_per_ms];
  d[D_share] = -expm1(R(-0.5) * dt * p[P_b_per_ms] * p[P_d]);  // half a step's
  d[D_inverse_d] = 1 / p[P_d];
  d[D_resting] = p[P_resting_mV];
  d[D_amplitude] = p[P_amplitude_mV];
  d[D_inverse_amplitude] = 1 / p[P_amplitude_mV];
}

real cell_fastest_rate(const real *p) { return p[P_c1_per_ms] + p[P_c2_per_ms] / p[P_d]; }

// One step of dt ms: half of v's, by its exact exponential at u (Rush & Larsen 1978), u's by an exponential with the slope of its
// right-hand side, the other half of v's. Second order in dt, also between steps of diffusion: with v by a leap-frog it would be
// driven by a u that is half a step of diffusion off. stimulus in mV/ms.
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  const realv u = (*V - d[D_resting]) * d[D_inverse_amplitude];
  const realv v = fma(d[D_share], fma(u, d[D_inverse_d], -state[S_v]), state[S_v]);
  const realv recovery = d[D_c2] * v;
  const realv rate = u * fma(d[D_c1] * (u - d[D_a]), 1 - u, -recovery) + stimulus * d[D_inverse_amplitude];
  const realv slope = d[D_c1] * (u * (2 + 2 * d[D_a] - 3 * u) - d[D_a]) - recovery;
  const realv x = dt * slope;
  const realv du = dt / fma(x, fma(x, (realv)(R(1.0) / 12), (realv)(R(-0.5))), (realv)(1)) * rate;
  *V = fma(d[D_amplitude], du, *V);
  const realv end = fma(d[D_share], fma(u + du, d[D_inverse_d], -v), v);
  state[S_v] = WHERE(isless(fabs(end), (realv)(R(1e-20))), (realv)(0), end);  // no denormal numbers, which CPUs are slow with
}
