// Courtemanche, Ramirez & Nattel 1998, Am. J. Physiol. 275:H301, doi 10.1152/ajpheart.1998.275.1.H301: human atrial cell.
// Equations of its appendix: membrane, concentrations, INa, IK1, Ito, IKur, IKr, IKs, ICaL, INaK, INaCa, background and pump
// currents, release, transfer, uptake and leak of the reticulum, buffers.
//     dV/dt = -(INa + IK1 + Ito + IKur + IKr + IKs + ICaL + INaK + INaCa + IpCa + IbNa + IbCa) + J_stim      pA/pF = mV/ms
// The rate of ui has the sign of the model's CellML file, with which the paper's own figure agrees, its printed formula does not.
// Na and K are kept as changes from their initial concentrations: a float of 139 mM could not follow them step by step.
// A cell model is one file: the lines //@ declare it to the host, the functions below are what the kernels call.
//
//@ parameter gNa 7.8 0 80 mS/uF "fast sodium conductance" "Courtemanche et al. 1998, table 1"
//@ parameter gK1 0.09 0 1 mS/uF "inward rectifier conductance" "Courtemanche et al. 1998, table 1"
//@ parameter gto 0.1652 0 2 mS/uF "transient outward conductance" "Courtemanche et al. 1998, table 1"
//@ parameter gKur 0.005 0 0.05 mS/uF "ultrarapid delayed rectifier conductance at negative potentials" "Courtemanche et al. 1998"
//@ parameter gKur_gain 0.05 0 0.5 mS/uF "what depolarisation adds to the ultrarapid conductance" "Courtemanche et al. 1998"
//@ parameter gKr 0.029411765 0 0.3 mS/uF "rapid delayed rectifier conductance" "Courtemanche et al. 1998, CellML's digits"
//@ parameter gKs 0.12941176 0 1.3 mS/uF "slow delayed rectifier conductance" "Courtemanche et al. 1998, CellML's digits"
//@ parameter gCaL 0.12375 0 1.2 mS/uF "L-type calcium conductance" "Courtemanche et al. 1998, CellML's digits"
//@ parameter ECaL_mV 65 20 120 mV "reversal potential of the L-type current" "Courtemanche et al. 1998"
//@ parameter gbNa 0.0006744375 0 0.007 mS/uF "background sodium conductance" "Courtemanche et al. 1998, CellML's digits"
//@ parameter gbCa 0.001131 0 0.011 mS/uF "background calcium conductance" "Courtemanche et al. 1998, CellML's digits"
//@ parameter kNaK 0.59933874 0 6 pA/pF "greatest current of the sodium-potassium pump" "Courtemanche et al. 1998, CellML's digits"
//@ parameter kNaCa 1600 0 16000 pA/pF "greatest current of the sodium-calcium exchanger" "Courtemanche et al. 1998, table 1"
//@ parameter kpCa 0.275 0 3 pA/pF "greatest current of the sarcolemmal calcium pump" "Courtemanche et al. 1998, table 1"
//@ parameter KpCa_mM 0.0005 1e-5 0.01 mM "half saturation of the calcium pump" "Courtemanche et al. 1998"
//@ parameter KmNai_mM 10 0.5 100 mM "half saturation of the sodium-potassium pump by sodium" "Courtemanche et al. 1998, table 1"
//@ parameter KmKo_mM 1.5 0.05 15 mM "half saturation of the sodium-potassium pump by potassium" "Courtemanche et al. 1998, table 1"
//@ parameter KmNa_mM 87.5 5 800 mM "half saturation of the exchanger by sodium" "Courtemanche et al. 1998, table 1"
//@ parameter KmCa_mM 1.38 0.05 15 mM "half saturation of the exchanger by calcium" "Courtemanche et al. 1998, table 1"
//@ parameter ksat 0.1 0 1 1 "saturation of the exchanger at negative potentials" "Courtemanche et al. 1998, table 1"
//@ parameter exchanger_gamma 0.35 0 1 1 "place of the exchanger's energy barrier" "Courtemanche et al. 1998, table 1"
//@ parameter Q10 3 1 6 1 "temperature factor of the rates of Ito and IKur" "Courtemanche et al. 1998, table 1"
//@ parameter tau_fCa_ms 2 0.1 50 ms "time constant of calcium inactivation" "Courtemanche et al. 1998"
//@ parameter Ko_mM 5.4 1 20 mM "extracellular potassium" "Courtemanche et al. 1998, table 1"
//@ parameter Nao_mM 140 50 250 mM "extracellular sodium" "Courtemanche et al. 1998, table 1"
//@ parameter Cao_mM 1.8 0.1 10 mM "extracellular calcium" "Courtemanche et al. 1998, table 1"
//@ parameter Ki_mM 139 50 200 mM "initial intracellular potassium" "Courtemanche et al. 1998, table 2"
//@ parameter Nai_mM 11.17 1 30 mM "initial intracellular sodium" "Courtemanche et al. 1998, CellML's digits"
//@ parameter temperature_K 310 280 320 K "temperature" "Courtemanche et al. 1998, table 1"
//@ parameter capacitance_pF 100 5 1000 pF "capacitance of a cell" "Courtemanche et al. 1998, table 1"
//@ parameter Vi_um3 13668 1000 1e5 um3 "cytoplasmic volume" "Courtemanche et al. 1998, table 1"
//@ parameter Vup_um3 1109.52 100 1e4 um3 "volume of the network reticulum" "Courtemanche et al. 1998, table 1"
//@ parameter Vrel_um3 96.48 10 1000 um3 "volume of the junctional reticulum" "Courtemanche et al. 1998, table 1"
//@ parameter krel 30 0 300 1/ms "greatest release rate" "Courtemanche et al. 1998, table 1"
//@ parameter tau_u_ms 8 0.5 80 ms "time constant of the release's activation" "Courtemanche et al. 1998"
//@ parameter tau_tr_ms 180 10 2000 ms "time constant of the transfer in the reticulum" "Courtemanche et al. 1998, table 1"
//@ parameter Iup_mM_per_ms 0.005 0 0.05 mM/ms "greatest uptake into the reticulum" "Courtemanche et al. 1998, table 1"
//@ parameter Kup_mM 0.00092 1e-4 0.01 mM "half saturation of the uptake" "Courtemanche et al. 1998, table 1"
//@ parameter Caup_max_mM 15 1 150 mM "greatest calcium of the network reticulum, sets its leak" "Courtemanche et al. 1998, table 1"
//@ parameter cmdn_mM 0.05 0 0.5 mM "calmodulin" "Courtemanche et al. 1998, table 1"
//@ parameter trpn_mM 0.07 0 0.7 mM "troponin" "Courtemanche et al. 1998, table 1"
//@ parameter csqn_mM 10 0 100 mM "calsequestrin" "Courtemanche et al. 1998, table 1"
//@ parameter Kcmdn_mM 0.00238 1e-4 0.03 mM "half saturation of calmodulin" "Courtemanche et al. 1998, table 1"
//@ parameter Ktrpn_mM 0.0005 1e-5 0.005 mM "half saturation of troponin" "Courtemanche et al. 1998, table 1"
//@ parameter Kcsqn_mM 0.8 0.05 8 mM "half saturation of calsequestrin" "Courtemanche et al. 1998, table 1"
//@ parameter stimulus_potassium 0 0 1 1 "share of the stimulus that enters as potassium" "Courtemanche et al. 1998, equation 22: none; 1: no charge is lost"
//@ parameter resting_mV -81.18 -120 0 mV "initial transmembrane potential" "Courtemanche et al. 1998, CellML's digits"
//@ rest resting_mV
//@ potential -200 200
//@ state Cai 0.0001013
//@ state Carel 1.488
//@ state Caup 1.488
//@ state Nai_change 0
//@ state Ki_change 0
//@ state m 0.002908 0 1
//@ state h 0.9649 0 1
//@ state j 0.9775 0 1
//@ state oa 0.03043 0 1
//@ state oi 0.9992 0 1
//@ state ua 0.004966 0 1
//@ state ui 0.9986 0 1
//@ state xr 3.296e-5 0 1
//@ state xs 0.01869 0 1
//@ state d 0.0001367 0 1
//@ state f 0.9996 0 1
//@ state fCa 0.7755 0 1
//@ state u 0 0 1
//@ state v 1 0 1
//@ state w 0.9992 0 1
//@ derived gNa gNa
//@ derived gK1 gK1
//@ derived gto gto
//@ derived gKur gKur
//@ derived gKur_gain gKur_gain
//@ derived gKr gKr
//@ derived gKs gKs
//@ derived gCaL gCaL
//@ derived ECaL ECaL_mV
//@ derived gbNa gbNa
//@ derived gbCa gbCa
//@ derived NaK kNaK Ko_mM KmKo_mM
//@ derived NaK_shape Nao_mM
//@ derived KmNai KmNai_mM
//@ derived NaCa_in kNaCa KmNa_mM Nao_mM KmCa_mM Cao_mM
//@ derived NaCa_out kNaCa KmNa_mM Nao_mM KmCa_mM Cao_mM
//@ derived ksat ksat
//@ derived gamma exchanger_gamma
//@ derived kpCa kpCa
//@ derived KpCa KpCa_mM
//@ derived Q10 Q10
//@ derived fCa_step tau_fCa_ms
//@ derived log_Ko Ko_mM
//@ derived log_Nao Nao_mM
//@ derived log_Cao Cao_mM
//@ derived Ki Ki_mM
//@ derived Nai Nai_mM
//@ derived RT_over_F temperature_K
//@ derived F_over_RT temperature_K
//@ derived mM_per_pA capacitance_pF Vi_um3
//@ derived stimulus_potassium stimulus_potassium
//@ derived up_over_i Vup_um3 Vi_um3
//@ derived rel_over_i Vrel_um3 Vi_um3
//@ derived rel_over_up Vrel_um3 Vup_um3
//@ derived Fn_release Vrel_um3
//@ derived Fn_current capacitance_pF
//@ derived krel krel
//@ derived u_step tau_u_ms
//@ derived inverse_tau_tr tau_tr_ms
//@ derived Iup Iup_mM_per_ms
//@ derived Kup Kup_mM
//@ derived leak Iup_mM_per_ms Caup_max_mM
//@ derived cmdn cmdn_mM Kcmdn_mM
//@ derived trpn trpn_mM Ktrpn_mM
//@ derived csqn csqn_mM Kcsqn_mM
//@ derived Kcmdn Kcmdn_mM
//@ derived Ktrpn Ktrpn_mM
//@ derived Kcsqn Kcsqn_mM

void cell_derive(const real *p, real dt, real *d) {
  const real gas = R(8.3143), F = R(96.4867);  // J/(mol K), C/mmol: R T / F in mV
  const real Nao = p[P_Nao_mM], Ko = p[P_Ko_mM], Cao = p[P_Cao_mM], KmNa = p[P_KmNa_mM];
  d[D_gNa] = p[P_gNa];
  d[D_gK1] = p[P_gK1];
  d[D_gto] = p[P_gto];
  d[D_gKur] = p[P_gKur];
  d[D_gKur_gain] = p[P_gKur_gain];
  d[D_gKr] = p[P_gKr];
  d[D_gKs] = p[P_gKs];
  d[D_gCaL] = p[P_gCaL];
  d[D_ECaL] = p[P_ECaL_mV];
  d[D_gbNa] = p[P_gbNa];
  d[D_gbCa] = p[P_gbCa];
  d[D_NaK] = p[P_kNaK] * Ko / (Ko + p[P_KmKo_mM]);
  d[D_NaK_shape] = R(0.0365) / 7 * (exp(Nao / R(67.3)) - 1);
  d[D_KmNai] = p[P_KmNai_mM];
  const real exchange = p[P_kNaCa] / ((KmNa * KmNa * KmNa + Nao * Nao * Nao) * (p[P_KmCa_mM] + Cao));
  d[D_NaCa_in] = exchange * Cao;
  d[D_NaCa_out] = exchange * Nao * Nao * Nao;
  d[D_ksat] = p[P_ksat];
  d[D_gamma] = p[P_exchanger_gamma];
  d[D_kpCa] = p[P_kpCa];
  d[D_KpCa] = p[P_KpCa_mM];
  d[D_Q10] = p[P_Q10];
  d[D_fCa_step] = -expm1(-dt / p[P_tau_fCa_ms]);
  d[D_log_Ko] = log(Ko);
  d[D_log_Nao] = log(Nao);
  d[D_log_Cao] = log(Cao);
  d[D_Ki] = p[P_Ki_mM];
  d[D_Nai] = p[P_Nai_mM];
  d[D_RT_over_F] = gas * p[P_temperature_K] / F;
  d[D_F_over_RT] = F / (gas * p[P_temperature_K]);
  d[D_mM_per_pA] = p[P_capacitance_pF] / (p[P_Vi_um3] * F);
  d[D_stimulus_potassium] = p[P_stimulus_potassium];
  d[D_up_over_i] = p[P_Vup_um3] / p[P_Vi_um3];
  d[D_rel_over_i] = p[P_Vrel_um3] / p[P_Vi_um3];
  d[D_rel_over_up] = p[P_Vrel_um3] / p[P_Vup_um3];
  d[D_Fn_release] = 1000 * p[P_Vrel_um3] / R(1.367);
  d[D_Fn_current] = 500 * p[P_capacitance_pF] / F / R(1.367);
  d[D_krel] = p[P_krel];
  d[D_u_step] = -expm1(-dt / p[P_tau_u_ms]);
  d[D_inverse_tau_tr] = 1 / p[P_tau_tr_ms];
  d[D_Iup] = p[P_Iup_mM_per_ms];
  d[D_Kup] = p[P_Kup_mM];
  d[D_leak] = p[P_Iup_mM_per_ms] / p[P_Caup_max_mM];
  d[D_cmdn] = p[P_cmdn_mM] * p[P_Kcmdn_mM];
  d[D_trpn] = p[P_trpn_mM] * p[P_Ktrpn_mM];
  d[D_csqn] = p[P_csqn_mM] * p[P_Kcsqn_mM];
  d[D_Kcmdn] = p[P_Kcmdn_mM];
  d[D_Ktrpn] = p[P_Ktrpn_mM];
  d[D_Kcsqn] = p[P_Kcsqn_mM];
}

// Measured (tests/results/cell_models.md): with steps of 0.05 ms durations are within 0.9 ms, calcium within 1 %, fronts within
// 0.7 %. The upstroke quickens about with the root of the sodium conductance.
real cell_fastest_rate(const real *p) { return R(3.9) * fmax(R(1.0), sqrt(p[P_gNa] / R(7.8))); }

// m after dt ms at the potential v.
static inline realv courtemanche_m(realv m, realv v, real dt) {
  const realv x = R(-0.1) * (v + R(47.13)), opening = R(3.2) * over_expm1(x, exp(x));
  const realv rate = opening + R(0.08) * exp(v * (R(-1.0) / 11)), end = opening / rate;
  return fma(exp(-dt * rate), m - end, end);
}

// One step of dt ms. The gates go first, by their exponentials at V (Rush & Larsen 1978): that puts them half a step behind and half a
// step ahead of V, as a leap-frog does. Then V with these gates, its linear part by an exponential too: second order in dt for a
// cell by itself. In tissue diffusion changes V between steps and only m, the one gate as fast as that, would feel it: m goes half
// a step before and half a step after V (measured: fronts 4 times nearer their limit). stimulus in mV/ms.
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  const realv v = *V;
  const realv Cai = state[S_Cai], Carel = state[S_Carel], Caup = state[S_Caup];
  const realv Nai = d[D_Nai] + state[S_Nai_change], Ki = d[D_Ki] + state[S_Ki_change];

#define GO(gate, end, share) state[S_##gate] = fma(share, (end) - state[S_##gate], state[S_##gate])
#define TOWARDS(gate, end, rate) GO(gate, end, gate_share(dt * (rate)))
  // Fast sodium current.
  state[S_m] = courtemanche_m(state[S_m], v, R(0.5) * dt);
  {
    const intv low = isless(v, (realv)(R(-40.0))), high = isgreaterequal(v, (realv)(R(-40.0)));
    realv open_h = 0, rate_h = 0, open_j = 0, rate_j = 0;
    if (ANY(low)) {
      open_h = R(0.135) * exp((v + 80) * (-1 / R(6.8)));
      rate_h = open_h + R(3.56) * exp(v * R(0.079)) + R(3.1e5) * exp(v * R(0.35));
      open_j = (R(-1.2714e5) * exp(v * R(0.2444)) - R(3.474e-5) * exp(v * R(-0.04391))) * (v + R(37.78)) /
               (1 + exp((v + R(79.23)) * R(0.311)));
      rate_j = open_j + R(0.1212) * exp(v * R(-0.01052)) / (1 + exp((v + R(40.14)) * R(-0.1378)));
    }
    if (ANY(high)) {
      const realv high_h = 1 / (R(0.13) * (1 + exp((v + R(10.66)) * (-1 / R(11.1)))));
      const realv high_j = R(0.3) * exp(v * R(-2.535e-7)) / (1 + exp((v + 32) * R(-0.1)));
      open_h = WHERE(low, open_h, (realv)(0));
      open_j = WHERE(low, open_j, (realv)(0));
      rate_h = WHERE(low, rate_h, high_h);
      rate_j = WHERE(low, rate_j, high_j);
    }
    const realv end_h = open_h / rate_h;
    state[S_h] = fma(exp(-dt * rate_h), state[S_h] - end_h, end_h);  // rates of 1e3 / ms below -140 mV
    TOWARDS(j, open_j / rate_j, rate_j);
  }
  // Transient outward and ultrarapid currents.
  {
    const realv rate = R(0.65) * d[D_Q10] *
                       (1 / (exp((v + 10) * (-1 / R(8.5))) + exp((v - 30) * (R(-1.0) / 59))) + 1 / (R(2.5) + exp((v + 82) * (R(1.0) / 17))));
    const realv share = gate_share(dt * rate);
    GO(oa, 1 / (1 + exp((v + R(20.47)) * (-1 / R(17.54)))), share);
    GO(ua, 1 / (1 + exp((v + R(30.3)) * (-1 / R(9.6)))), share);
    TOWARDS(oi, 1 / (1 + exp((v + R(43.1)) * (1 / R(5.3)))),
            d[D_Q10] * (1 / (R(18.53) + exp((v + R(113.7)) * (1 / R(10.95)))) + 1 / (R(35.56) + exp((v + R(1.26)) * (-1 / R(7.44))))));
    TOWARDS(ui, 1 / (1 + exp((v - R(99.45)) * (1 / R(27.48)))),
            d[D_Q10] * (1 / (21 + exp((v - 185) * (R(-1.0) / 28))) + exp((v - 158) * (R(1.0) / 16))));
  }
  // Delayed rectifiers.
  {
    const realv x = (v + R(14.1)) * R(-0.2), y = (v - R(3.3328)) * (1 / R(5.1237));
    TOWARDS(xr, 1 / (1 + exp((v + R(14.1)) * (-1 / R(6.5)))),
            R(0.0015) * over_expm1(x, exp(x)) + R(7.3898e-5) * R(5.1237) * over_expm1(y, exp(y)));
    const realv s = v - R(19.9), a = s * (R(-1.0) / 17), b = s * (R(1.0) / 9);
    TOWARDS(xs, rsqrt(1 + exp(s * (-1 / R(12.7)))),
            2 * (R(6.8e-4) * over_expm1(a, exp(a)) + R(3.15e-4) * over_expm1(b, exp(b))));
  }
  // L-type calcium current.
  {
    const realv x = (v + 10) * (-1 / R(6.24)), e = exp(x), y = R(0.0337) * (v + 10);
    TOWARDS(d, 1 / (1 + exp((v + 10) * R(-0.125))), R(0.035) * R(6.24) * over_expm1(x, e) * (1 + e));
    TOWARDS(f, 1 / (1 + exp((v + 28) * (1 / R(6.9)))), (R(0.0197) * exp(-y * y) + R(0.02)) * (R(1.0) / 9));
    GO(fCa, 1 / (1 + Cai * (1 / R(0.00035))), d[D_fCa_step]);
  }

  // Currents, pA/pF.
  const realv v_K = v - d[D_RT_over_F] * (d[D_log_Ko] - log(Ki)), v_Na = v - d[D_RT_over_F] * (d[D_log_Nao] - log(Nai));
  const realv v_Ca = v - R(0.5) * d[D_RT_over_F] * (d[D_log_Cao] - log(Cai));
  const realv u = v * d[D_F_over_RT], e_u = exp(-u);
  const realv m = state[S_m], oa = state[S_oa], ua = state[S_ua], xs = state[S_xs];
  const realv g_Na = d[D_gNa] * m * m * m * state[S_h] * state[S_j];
  const realv g_to = d[D_gto] * oa * oa * oa * state[S_oi];
  const realv g_Kur = (d[D_gKur] + d[D_gKur_gain] / (1 + exp((v - 15) * (R(-1.0) / 13)))) * ua * ua * ua * state[S_ui];
  const realv g_Kr = d[D_gKr] * state[S_xr] / (1 + exp((v + 15) * (1 / R(22.4)))), g_Ks = d[D_gKs] * xs * xs;
  const realv g_K1 = d[D_gK1] / (1 + exp((v + 80) * R(0.07)));
  const realv g_CaL = d[D_gCaL] * state[S_d] * state[S_f] * state[S_fCa];

  const realv e_in = exp(d[D_gamma] * u), e_out = e_in * e_u;
  const realv INaCa = (d[D_NaCa_in] * e_in * Nai * Nai * Nai - d[D_NaCa_out] * e_out * Cai) / (1 + d[D_ksat] * e_out);
  const realv ratio = d[D_KmNai] / Nai;
  const realv INaK = d[D_NaK] / ((1 + ratio * sqrt(ratio)) * (1 + R(0.1245) * exp(R(-0.1) * u) + d[D_NaK_shape] * e_u));
  const realv IpCa = d[D_kpCa] * Cai / (Cai + d[D_KpCa]);
  const realv INa = g_Na * v_Na, IbNa = d[D_gbNa] * v_Na, IbCa = d[D_gbCa] * v_Ca, ICaL = g_CaL * (v - d[D_ECaL]);
  const realv IK = (g_K1 + g_to + g_Kur + g_Kr + g_Ks) * v_K;

  const realv total = stimulus - (INa + IbNa + ICaL + IbCa + INaCa + INaK + IpCa + IK);
  const realv z_V = dt * (g_Na + g_to + g_Kur + g_Kr + g_Ks + g_CaL);
  *V = fma(dt / fma(z_V, fma(z_V, (realv)(R(1.0) / 12), (realv)(R(0.5))), (realv)(1)), total, v);

  // Release of calcium: u, v, w follow the flux Fn, here in units of 1.367e-15, the width of their steps.
  realv release = d[D_krel] * state[S_u] * state[S_u] * state[S_v] * state[S_w];
  {
    const realv Fn = d[D_Fn_release] * release * (Carel - Cai) - d[D_Fn_current] * (R(0.5) * ICaL - R(0.2) * INaCa);
    const realv opened = 1 / (1 + exp(250 - Fn)), closed = 1 / (1 + exp(Fn - 50));
    GO(u, opened, d[D_u_step]);
    state[S_u] = WHERE(isless(state[S_u], (realv)(R(1e-15))), (realv)(0), state[S_u]);  // no denormal numbers, which CPUs are slow with
    TOWARDS(v, closed, 1 / fma(opened, (realv)(R(2.09)), (realv)(R(1.91))));
    const realv x = (v - R(7.9)) * R(-0.2), e = exp(x);
    TOWARDS(w, 1 / (1 + exp((v - 40) * (R(1.0) / 17))), over_expm1(x, e) * (1 + R(0.3) * e) * (1 / R(1.2)));
  }
#undef TOWARDS
#undef GO

  // Concentrations, mM.
  const realv scale = dt * d[D_mM_per_pA];
  state[S_Nai_change] -= scale * (INa + IbNa + 3 * (INaK + INaCa));
  state[S_Ki_change] -= scale * (IK - 2 * INaK - d[D_stimulus_potassium] * stimulus);

  const realv transfer = (Caup - Carel) * d[D_inverse_tau_tr];
  const realv uptake = d[D_Iup] * Cai / (Cai + d[D_Kup]) - d[D_leak] * Caup;
  const realv c = Carel + d[D_Kcsqn], square = c * c, free_rel = square / (square + d[D_csqn]);
  release = d[D_krel] * state[S_u] * state[S_u] * state[S_v] * state[S_w];
  // The store empties by an exponential; what it gives is what the cytoplasm gets.
  const realv z = dt * free_rel * release;
  const realv Irel = release * (Carel - Cai) / fma(z, fma(z, (realv)(R(1.0) / 12), (realv)(R(0.5))), (realv)(1));
  state[S_Carel] = fma(dt * free_rel, transfer - Irel, Carel);
  state[S_Caup] = fma(dt, uptake - transfer * d[D_rel_over_up], Caup);
  const realv a = Cai + d[D_Ktrpn], b = Cai + d[D_Kcmdn];
  const realv bound = 1 + d[D_trpn] / (a * a) + d[D_cmdn] / (b * b);
  const realv flux = R(0.5) * d[D_mM_per_pA] * (2 * INaCa - IpCa - ICaL - IbCa) - d[D_up_over_i] * uptake + d[D_rel_over_i] * Irel;
  state[S_Cai] = fma(dt / bound, flux, Cai);
  state[S_m] = courtemanche_m(state[S_m], *V, R(0.5) * dt);
}
