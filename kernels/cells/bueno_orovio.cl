// Bueno-Orovio, Cherry & Fenton 2008, J. Theor. Biol. 253:544, doi 10.1016/j.jtbi.2008.03.029: minimal model of human ventricular
// cells; H is the step function:
//     du/dt = -(J_fi + J_so + J_si) + J_stim,                     V = resting + amplitude u
//     J_fi = -v H(u - theta_v) (u - theta_v) (u_u - u) / tau_fi,  J_si = -H(u - theta_w) w s / tau_si
//     J_so = (u - u_o) (1 - H(u - theta_w)) / tau_o + H(u - theta_w) / tau_so
// Defaults: epicardium, table 1. The table's other layers, as endocardium and mid-myocardium (what is not listed stays):
//     u_u 1.56, 1.61   theta_v_minus 0.2, 0.1   theta_o 0.006, 0.005   tau_v1_minus_ms 75, 80   tau_v2_minus_ms 10, 1.4506
//     tau_w1_minus_ms 6, 70   tau_w2_minus_ms 140, 8   k_w_minus 200, 200   u_w_minus 0.016, 0.016   tau_w_plus_ms 280, 280
//     tau_fi_ms 0.1, 0.078   tau_o1_ms 470, 410   tau_o2_ms 6, 7   tau_so1_ms 40, 91   tau_so2_ms 1.2, 0.8   k_so 2, 2.1
//     u_so 0.65, 0.6   tau_s2_ms 2, 4   tau_si_ms 2.9013, 3.3849   tau_w_inf 0.0273, 0.01   w_inf_star 0.78, 0.5
// The inward current has no reversal potential: what bounds u is that the outward current is the greater at last, 1 / tau_so2 > 1 / tau_si.
// The ranges of k_so, u_so, tau_so2 and tau_si keep to that.
// A cell model is one file: the lines //@ declare it to the host, the functions below are what the kernels call.
//
//@ parameter u_o 0 -0.5 0.5 1 "potential at rest" "Bueno-Orovio et al. 2008, table 1"
//@ parameter u_u 1.55 0.5 3 1 "potential at which the fast inward current ends" "Bueno-Orovio et al. 2008, table 1"
//@ parameter theta_v 0.3 0.01 1 1 "threshold of the fast inward current" "Bueno-Orovio et al. 2008, table 1"
//@ parameter theta_w 0.13 0.01 1 1 "threshold of the slow currents" "Bueno-Orovio et al. 2008, table 1"
//@ parameter theta_v_minus 0.006 0.0001 1 1 "threshold of the recovery of v" "Bueno-Orovio et al. 2008, table 1"
//@ parameter theta_o 0.006 0.0001 1 1 "threshold of the outward current's time constant" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_v1_minus_ms 60 1 5000 ms "recovery of v below theta_v_minus" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_v2_minus_ms 1150 1 10000 ms "recovery of v above theta_v_minus" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_v_plus_ms 1.4506 0.1 50 ms "inactivation of the fast inward current" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_w1_minus_ms 60 1 1000 ms "recovery of w at rest" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_w2_minus_ms 15 1 1000 ms "recovery of w above u_w_minus" "Bueno-Orovio et al. 2008, table 1"
//@ parameter k_w_minus 65 1 1000 1 "steepness of the change between them" "Bueno-Orovio et al. 2008, table 1"
//@ parameter u_w_minus 0.03 0.0001 1 1 "potential of that change" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_w_plus_ms 200 20 1000 ms "inactivation of the slow inward current" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_fi_ms 0.11 0.02 5 ms "fast inward current" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_o1_ms 400 5 5000 ms "slow outward current at rest" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_o2_ms 6 0.2 100 ms "slow outward current between theta_o and theta_w" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_so1_ms 30.0181 1 500 ms "slow outward current below u_so" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_so2_ms 0.9957 0.1 1.8 ms "slow outward current above u_so" "Bueno-Orovio et al. 2008, table 1"
//@ parameter k_so 2.0458 1 10 1 "steepness of the change between them" "Bueno-Orovio et al. 2008, table 1"
//@ parameter u_so 0.65 0.3 1 1 "potential of that change" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_s1_ms 2.7342 0.1 100 ms "time constant of s below theta_w" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_s2_ms 16 0.1 500 ms "time constant of s above theta_w" "Bueno-Orovio et al. 2008, table 1"
//@ parameter k_s 2.0994 0.1 50 1 "steepness of the activation of s" "Bueno-Orovio et al. 2008, table 1"
//@ parameter u_s 0.9087 0.01 3 1 "potential of the activation of s" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_si_ms 1.8875 1.8 50 ms "slow inward current" "Bueno-Orovio et al. 2008, table 1"
//@ parameter tau_w_inf 0.07 0.001 2 1 "potential by which the end of w falls to 0" "Bueno-Orovio et al. 2008, table 1"
//@ parameter w_inf_star 0.94 0 1 1 "end of w above theta_o" "Bueno-Orovio et al. 2008, table 1"
//@ parameter resting_mV -84 -120 0 mV "transmembrane potential at u = 0" "Bueno-Orovio et al. 2008, section 2"
//@ parameter amplitude_mV 85.7 1 200 mV "transmembrane potential difference of u = 1" "Bueno-Orovio et al. 2008, section 2"
//@ rest resting_mV
//@ potential -1 4 amplitude_mV
//@ state v 1 0 1
//@ state w 1 0 1
//@ state s 0 0 1
//@ derived u_o u_o
//@ derived u_u u_u
//@ derived theta_v theta_v
//@ derived theta_w theta_w
//@ derived theta_v_minus theta_v_minus
//@ derived theta_o theta_o
//@ derived v1_share tau_v1_minus_ms
//@ derived v2_share tau_v2_minus_ms
//@ derived v_plus_share tau_v_plus_ms
//@ derived tau_w1 tau_w1_minus_ms
//@ derived tau_w_change tau_w1_minus_ms tau_w2_minus_ms
//@ derived k_w k_w_minus
//@ derived u_w u_w_minus
//@ derived w_plus_share tau_w_plus_ms
//@ derived inverse_tau_fi tau_fi_ms
//@ derived inverse_tau_o1 tau_o1_ms
//@ derived inverse_tau_o2 tau_o2_ms
//@ derived tau_so1 tau_so1_ms
//@ derived tau_so_change tau_so1_ms tau_so2_ms
//@ derived k_so k_so
//@ derived u_so u_so
//@ derived s1_share tau_s1_ms
//@ derived s2_share tau_s2_ms
//@ derived k_s k_s
//@ derived u_s u_s
//@ derived inverse_tau_si tau_si_ms
//@ derived inverse_tau_w_inf tau_w_inf
//@ derived w_inf_star w_inf_star
//@ derived resting resting_mV
//@ derived amplitude amplitude_mV
//@ derived inverse_amplitude amplitude_mV

void cell_derive(const real *p, real dt, real *d) {
  d[D_u_o] = p[P_u_o];
  d[D_u_u] = p[P_u_u];
  d[D_theta_v] = p[P_theta_v];
  d[D_theta_w] = p[P_theta_w];
  d[D_theta_v_minus] = p[P_theta_v_minus];
  d[D_theta_o] = p[P_theta_o];
  d[D_v1_share] = -expm1(-dt / p[P_tau_v1_minus_ms]);
  d[D_v2_share] = -expm1(-dt / p[P_tau_v2_minus_ms]);
  d[D_v_plus_share] = -expm1(-dt / p[P_tau_v_plus_ms]);
  d[D_tau_w1] = p[P_tau_w1_minus_ms];
  d[D_tau_w_change] = p[P_tau_w2_minus_ms] - p[P_tau_w1_minus_ms];
  d[D_k_w] = -2 * p[P_k_w_minus];
  d[D_u_w] = p[P_u_w_minus];
  d[D_w_plus_share] = -expm1(-dt / p[P_tau_w_plus_ms]);
  d[D_inverse_tau_fi] = 1 / p[P_tau_fi_ms];
  d[D_inverse_tau_o1] = 1 / p[P_tau_o1_ms];
  d[D_inverse_tau_o2] = 1 / p[P_tau_o2_ms];
  d[D_tau_so1] = p[P_tau_so1_ms];
  d[D_tau_so_change] = p[P_tau_so2_ms] - p[P_tau_so1_ms];
  d[D_k_so] = -2 * p[P_k_so];
  d[D_u_so] = p[P_u_so];
  d[D_s1_share] = -expm1(-dt / p[P_tau_s1_ms]);
  d[D_s2_share] = -expm1(-dt / p[P_tau_s2_ms]);
  d[D_k_s] = -2 * p[P_k_s];
  d[D_u_s] = p[P_u_s];
  d[D_inverse_tau_si] = 1 / p[P_tau_si_ms];
  d[D_inverse_tau_w_inf] = 1 / p[P_tau_w_inf];
  d[D_w_inf_star] = p[P_w_inf_star];
  d[D_resting] = p[P_resting_mV];
  d[D_amplitude] = p[P_amplitude_mV];
  d[D_inverse_amplitude] = 1 / p[P_amplitude_mV];
}

// Measured (tests/results/cell_models.md): with steps of 0.05 ms durations are within 1.2 ms for all three layers and the
// upstroke within 2 %. Half of that makes durations worse in single precision: potentials near rest, in mV, then change by
// less than a float can tell.
real cell_fastest_rate(const real *p) { return R(0.3) / p[P_tau_fi_ms]; }

// One step of dt ms. The gates go first, by their exact exponentials at u (Rush & Larsen 1978): that puts them half a step behind
// and half a step ahead of u, as a leap-frog does. Then u by an exponential with the slope of its right-hand side. Second order in dt
// between the thresholds. stimulus in mV/ms.
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  const realv u = (*V - d[D_resting]) * d[D_inverse_amplitude];
  const intv above_v = isgreaterequal(u, d[D_theta_v]), above_w = isgreaterequal(u, d[D_theta_w]);
  const intv above_v_minus = isgreaterequal(u, d[D_theta_v_minus]), above_o = isgreaterequal(u, d[D_theta_o]);
  const realv zero = 0, one = 1;

  // v_inf is 1 below theta_v_minus and 0 above it, as above theta_v.
  const realv v_end = WHERE(above_v_minus, zero, WHERE(above_v, zero, one));
  const realv v_share = WHERE(above_v, d[D_v_plus_share], WHERE(above_v_minus, d[D_v2_share], d[D_v1_share]));
  const realv v = fma(v_share, v_end - state[S_v], state[S_v]);

  const realv tau_w = d[D_tau_w1] + d[D_tau_w_change] / (1 + exp(d[D_k_w] * (u - d[D_u_w])));
  // 1 - exp(-z) to z^5 / 720; tau_w is at least 1 ms. Below u = 0, where the paper's end of w passes 1, it is held.
  const realv z = fmin(dt / tau_w, (realv)(R(3.4641016)));
  const realv w_minus_share = z / fma(z, fma(z, (realv)(R(1.0) / 12), (realv)(R(0.5))), one);
  const realv w_minus_end = WHERE(above_o, d[D_w_inf_star], 1 - fmax(u, zero) * d[D_inverse_tau_w_inf]);
  const realv w_end = WHERE(above_w, zero, fmax(w_minus_end, zero));
  const realv w = fma(WHERE(above_w, d[D_w_plus_share], w_minus_share), w_end - state[S_w], state[S_w]);

  const realv s_end = 1 / (1 + exp(d[D_k_s] * (u - d[D_u_s])));
  const realv s = fma(WHERE(above_w, d[D_s2_share], d[D_s1_share]), s_end - state[S_s], state[S_s]);

  const realv e_so = exp(d[D_k_so] * (u - d[D_u_so])), part = 1 / (1 + e_so);
  const realv rate_so = 1 / (d[D_tau_so1] + d[D_tau_so_change] * part);
  const realv rate_o = WHERE(above_o, d[D_inverse_tau_o2], d[D_inverse_tau_o1]);
  const realv fast = WHERE(above_v, v * d[D_inverse_tau_fi], zero);
  const realv slow = WHERE(above_w, rate_so - w * s * d[D_inverse_tau_si], (u - d[D_u_o]) * rate_o);
  const realv rate = fma(fast * (u - d[D_theta_v]), d[D_u_u] - u, stimulus * d[D_inverse_amplitude] - slow);
  // d(rate_so)/du = -rate_so^2 tau_so_change part (1 - part) 2 k_so, with D_k_so = -2 k_so; a huge e_so gives 0.
  const realv so_slope = rate_so * rate_so * d[D_tau_so_change] * part * (1 - part) * d[D_k_so];
  const realv slope = fast * (d[D_u_u] + d[D_theta_v] - 2 * u) - WHERE(above_w, so_slope, rate_o);
  const realv x = dt * slope;
  *V = fma(d[D_amplitude] * dt / fma(x, fma(x, (realv)(R(1.0) / 12), (realv)(R(-0.5))), one), rate, *V);
  state[S_v] = WHERE(isless(v, (realv)(R(1e-20))), zero, v);  // no denormal numbers, which CPUs are slow with
  state[S_w] = w;
  state[S_s] = s;
}
