// Human cardiac contraction driven by calcium: Land, Park-Holohan, Smith, dos Remedios, Kentish & Niederer 2017, J. Mol. Cell. Cardiol.
// 106:68, doi 10.1016/j.yjmcc.2017.03.008, the model of intact human muscle (n_Tm 5, Ca50 0.805 uM, T_ref 120 kPa; constants as in a public
// implementation, whose other set is that of skinned cells). Ca in uM (drive: mM), rates in 1/ms:
//   troponin      dR/dt = k_TRPN ((Ca / Ca50)^n_TRPN (1 - R) - R),  Ca50 = Ca50_ref + beta_1 (min(lambda, 1.2) - 1)
//   tropomyosin   dB/dt = k_b min(R^(-n_Tm/2), 100) U - k_u R^(n_Tm/2) B,  U = 1 - B - W - S
//   crossbridges  dW/dt = k_uw U - (k_wu + k_ws + gamma_wu) W,  dS/dt = k_ws W - (k_su + gamma_su) S
//   distortion    dz_w/dt = A_w dlambda/dt - c_w z_w,  dz_s/dt = A_s dlambda/dt - c_s z_s
//   tension       T = h(lambda) T_ref / r_s ((1 + z_s) S + z_w W)
// with k_b = k_u TRPN50^n_Tm / (1 - r_s - (1 - r_s) r_w), k_wu = k_uw (1/r_w - 1) - k_ws, k_su = k_ws r_w (1/r_s - 1),
// A_s = A_w = A_eff r_s / ((1 - r_s) r_w + r_s), c_w = phi k_uw (1 - r_s)(1 - r_w) / ((1 - r_s) r_w), c_s = phi k_ws (1 - r_s) r_w / r_s,
// gamma_wu = gamma_w |z_w|, gamma_su = gamma_s max(z_s, -z_s - 1, 0), and length dependence h = max(0, h'(min(lambda, 1.2))),
// h'(l) = 1 + beta_0 (l + min(l, 0.87) - 1.87). Its viscoelastic passive part is left to the law of the tissue.
// Lengthening and shortening act through z_w and z_s, which are states that lag (2.5 and 25 ms): no step is too long to be stable by itself, but
// the crossbridges are an elasticity of some 1000 kPa in a contracted fibre, which tension_stiffness tells.
//
//@ states 6
//@ drive calcium
//@ per_stretch2 1
//@ parameter peak_kPa 120 0 1e4 kPa "tension of all crossbridges, T_ref" "Land et al. 2017, intact muscle"
//@ parameter calcium_50_uM 0.805 0.01 100 uM "calcium of half saturation of troponin at rest length" "Land et al. 2017, intact muscle"
//@ parameter troponin_rate_per_ms 0.1 1e-4 10 1/ms "unbinding of calcium, k_TRPN" "Land et al. 2017, intact muscle"
//@ parameter n_troponin 2 0.5 10 1 "cooperativity of calcium binding" "Land et al. 2017, intact muscle"
//@ parameter troponin_50 0.35 0.01 1 1 "saturation of half blocking" "Land et al. 2017, intact muscle"
//@ parameter n_tropomyosin 5 0.5 10 1 "cooperativity of blocking" "Land et al. 2017, intact muscle"
//@ parameter unblocking_per_ms 1 1e-4 10 1/ms "rate of unblocking, k_u" "Land et al. 2017, intact muscle"
//@ parameter k_uw_per_ms 0.182 1e-4 10 1/ms "unbound to weakly bound" "Land et al. 2017, intact muscle"
//@ parameter k_ws_per_ms 0.012 1e-5 10 1/ms "weakly to strongly bound" "Land et al. 2017, intact muscle"
//@ parameter r_w 0.5 0.05 0.9 1 "share of weakly bound among those not strongly bound" "Land et al. 2017, intact muscle"
//@ parameter r_s 0.25 0.05 0.9 1 "share of strongly bound at full activation" "Land et al. 2017, intact muscle"
//@ parameter gamma_w 0.615 0 10 1/ms "detachment of weakly bound by distortion" "Land et al. 2017, intact muscle"
//@ parameter gamma_s 0.0085 0 10 1/ms "detachment of strongly bound by distortion" "Land et al. 2017, intact muscle"
//@ parameter phi 2.23 0 20 1 "decay of distortion over the rate of binding" "Land et al. 2017, intact muscle"
//@ parameter A_eff 25 0 200 1 "distortion by a stretch" "Land et al. 2017, intact muscle"
//@ parameter beta_0 2.3 0 20 1 "growth of tension with stretch" "Land et al. 2017, intact muscle"
//@ parameter beta_1_uM -2.4 -20 20 uM "change of the calcium of half saturation with stretch" "Land et al. 2017, intact muscle"

static inline real calcium_length(real stretch, real beta_0) {
  const real l = fmin(stretch, R(1.2));
  return fmax(1 + beta_0 * (l + fmin(l, R(0.87)) - R(1.87)), R(0.0));
}

static inline real calcium_distortion(global const real *M) {
  const real r_s = M[M_r_s];
  return M[M_A_eff] * r_s / ((1 - r_s) * M[M_r_w] + r_s);
}

// States: troponin, 1 - B, W, S, z_w, z_s. Troponin and distortion go half a step, the crossbridges a whole one there, the others the
// other half; each by its own exponential, and those of the crossbridges first in one order and then in the other (second order).
real tension_step(real *state, real since_activation_ms, real beat_ms, real drive, real stretch, real stretch_rate, real dt_ms,
                  global const real *M) {
  const real r_w = M[M_r_w], r_s = M[M_r_s], k_uw = M[M_k_uw_per_ms], k_ws = M[M_k_ws_per_ms], part = R(0.5) * dt_ms;
  const real middle = fmin(stretch - part * stretch_rate, R(1.2));
  const real Ca50 = fmax(M[M_calcium_50_uM] + M[M_beta_1_uM] * (middle - 1), R(1e-3));
  const real binding = powr(fmax(1000 * drive, R(0.0)) / Ca50, M[M_n_troponin]);
  const real saturation = binding / (1 + binding), troponin_way = way(M[M_troponin_rate_per_ms] * (1 + binding), part);
  const real distortion = calcium_distortion(M) * stretch_rate;
  const real c_w = M[M_phi] * k_uw * (1 - r_w) / r_w, c_s = M[M_phi] * k_ws * (1 - r_s) * r_w / r_s;
  const real way_w = way(c_w, part), way_s = way(c_s, part);
  // Where phi is 0 distortion only grows.
  const real gain_w = c_w > 0 ? way_w / c_w : part, gain_s = c_s > 0 ? way_s / c_s : part;

  state[0] += (saturation - state[0]) * troponin_way;
  state[4] += distortion * gain_w - state[4] * way_w;
  state[5] += distortion * gain_s - state[5] * way_s;

  const real n = R(0.5) * M[M_n_tropomyosin], power = powr(fmax(state[0], R(1e-6)), n);
  const real free = 1 - r_s - (1 - r_s) * r_w;
  const real blocking = M[M_unblocking_per_ms] * powr(M[M_troponin_50], 2 * n) / free * fmin(1 / power, R(100.0));
  const real unblocking = M[M_unblocking_per_ms] * power;
  const real weak_off = fmax(k_uw * (1 / r_w - 1), k_ws) + M[M_gamma_w] * fabs(state[4]);  // k_wu + k_ws + gamma_wu
  const real strong_off =
      k_ws * r_w * (1 / r_s - 1) + M[M_gamma_s] * fmax(fmax(state[5], -state[5] - 1), R(0.0));
  const real open_way = way(blocking + unblocking, part), weak_way = way(k_uw + weak_off, part), strong_way = way(strong_off, part);
  real open = state[1], weak = state[2], strong = state[3];
#define GO_OPEN open += ((unblocking + blocking * (weak + strong)) / (blocking + unblocking) - open) * open_way
#define GO_WEAK weak += (k_uw * (open - strong) / (k_uw + weak_off) - weak) * weak_way
#define GO_STRONG strong += (k_ws * weak / strong_off - strong) * strong_way
  GO_OPEN;
  GO_WEAK;
  GO_STRONG;
  GO_STRONG;
  GO_WEAK;
  GO_OPEN;
#undef GO_OPEN
#undef GO_WEAK
#undef GO_STRONG
  state[1] = open;
  state[2] = weak;
  state[3] = strong;

  state[0] += (saturation - state[0]) * troponin_way;
  state[4] += distortion * gain_w - state[4] * way_w;
  state[5] += distortion * gain_s - state[5] * way_s;
  return calcium_length(stretch, M[M_beta_0]) * M[M_peak_kPa] / r_s * ((1 + state[5]) * strong + state[4] * weak);
}

real tension_stiffness(const real *state, real tension, real stretch, global const real *M) {
  const real h = calcium_length(stretch, M[M_beta_0]), T = M[M_peak_kPa] / M[M_r_s];
  const real slope = h > 0 && stretch < R(1.2) ? M[M_beta_0] * (stretch < R(0.87) ? 2 : 1) : R(0.0);
  return TENSION_SLOPE(h * T * calcium_distortion(M) * (state[3] + state[2]) + (h > 0 ? slope * fmax(tension, R(0.0)) / h : R(0.0)),
                       stretch);
}
