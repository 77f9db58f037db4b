// Aliev & Panfilov 1996, Chaos, Solitons & Fractals 7:293, doi 10.1016/0960-0779(95)00089-5, in the paper's
// units of time and potential (12.9 ms, V = 100 u - 80 mV):
//     du/dt = -k u (u - a) (u - 1) - u v + J_stim,   dv/dt = (epsilon_0 + mu_1 v / (u + mu_2)) (-v - k u (u - a - 1))
// A cell model is one file: the lines //@ declare it to the host, the functions below are what the kernels call.
//
//@ parameter k 8 0.5 50 1 "size of the cubic current" "Aliev & Panfilov 1996"
//@ parameter a 0.15 0.001 0.49 1 "threshold of excitation" "Aliev & Panfilov 1996"
//@ parameter epsilon_0 0.002 1e-5 0.1 1 "least rate of recovery" "Aliev & Panfilov 1996"
//@ parameter mu_1 0.2 0 2 1 "rate of recovery that depends on v" "Aliev & Panfilov 1996"
//@ parameter mu_2 0.3 0.01 2 1 "potential in the rate of recovery" "Aliev & Panfilov 1996"
//@ parameter time_unit_ms 12.9 0.5 200 ms "the model's unit of time" "Aliev & Panfilov 1996"
//@ parameter resting_mV -80 -120 0 mV "transmembrane potential at u = 0" "Aliev & Panfilov 1996"
//@ parameter amplitude_mV 100 1 200 mV "transmembrane potential difference between u = 0 and u = 1" "Aliev & Panfilov 1996"
//@ rest resting_mV
//@ potential -1 2 amplitude_mV
//@ state v 0
//@ derived k k
//@ derived a a
//@ derived epsilon_0 epsilon_0
//@ derived mu_1 mu_1
//@ derived mu_2 mu_2
//@ derived step time_unit_ms
//@ derived drive time_unit_ms amplitude_mV
//@ derived resting resting_mV
//@ derived amplitude amplitude_mV
//@ derived inverse_amplitude amplitude_mV

void cell_derive(const real *p, real dt, real *d) {
  d[D_k] = p[P_k];
  d[D_a] = p[P_a];
  d[D_epsilon_0] = p[P_epsilon_0];
  d[D_mu_1] = p[P_mu_1];
  d[D_mu_2] = p[P_mu_2];
  d[D_step] = dt / p[P_time_unit_ms];
  d[D_drive] = p[P_time_unit_ms] / p[P_amplitude_mV];
  d[D_resting] = p[P_resting_mV];
  d[D_amplitude] = p[P_amplitude_mV];
  d[D_inverse_amplitude] = 1 / p[P_amplitude_mV];
}

real cell_fastest_rate(const real *p) { return p[P_k] / p[P_time_unit_ms]; }

// v after half a step at u, by its exponential (Rush & Larsen 1978). The rate of recovery depends on v: first at v, then at the middle
// of that way. Below u = 0, where the paper's rate of recovery has a pole, it keeps its value at 0.
static inline realv recovered(realv v, realv u, const realv *d) {
  const realv slower = d[D_mu_1] / (fmax(u, (realv)(0)) + d[D_mu_2]), to = d[D_k] * u * (1 + d[D_a] - u), one = 1;
  realv end = v;
#pragma unroll
  for (int pass = 0; pass < 2; ++pass) {
    const realv epsilon = fma(slower, fmax(R(0.5) * (v + end), (realv)(0)), (realv)(d[D_epsilon_0]));
    const realv z = fmin(R(0.5) * d[D_step] * epsilon, (realv)(R(3.4641016)));
    const realv share = z / fma(z, fma(z, (realv)(R(1.0) / 12), (realv)(R(0.5))), one);  // 1 - exp(-z) to z^5 / 720
    end = fma(share, to - v, v);
  }
  return end;
}

// One step: half of v's, u's by an exponential with the slope of its right-hand side, the other half of v's. Second order in dt,
// also between steps of diffusion: with v by a leap-frog it would be driven by a u that is half a step of diffusion off.
// stimulus in mV/ms.
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  const realv u = (*V - d[D_resting]) * d[D_inverse_amplitude];
  const realv v = recovered(state[S_v], u, d);
  const realv rate = u * fma(d[D_k] * (u - d[D_a]), 1 - u, -v) + stimulus * d[D_drive];
  const realv slope = d[D_k] * (u * (2 + 2 * d[D_a] - 3 * u) - d[D_a]) - v;
  const realv x = d[D_step] * slope;
  const realv du = d[D_step] / fma(x, fma(x, (realv)(R(1.0) / 12), (realv)(R(-0.5))), (realv)(1)) * rate;
  *V = fma(d[D_amplitude], du, *V);
  const realv end = recovered(v, u + du, d);
  state[S_v] = WHERE(isless(fabs(end), (realv)(R(1e-20))), (realv)(0), end);  // no denormal numbers, which CPUs are slow with
}
