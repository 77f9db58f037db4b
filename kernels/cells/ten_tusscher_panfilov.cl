// ten Tusscher & Panfilov 2006, Am. J. Physiol. Heart Circ. Physiol. 291:H1088, doi 10.1152/ajpheart.00109.2006: human
// ventricular cell, epicardial by default. Currents and gates are the appendix of that paper; those it leaves unchanged are ten Tusscher et
// al. 2004, doi 10.1152/ajpheart.00794.2003, appendix (INa, IKr, IK1, INaCa, INaK, IpCa, IpK, background).
//     dV/dt = -(INa + ICaL + Ito + IKr + IKs + IK1 + INaCa + INaK + IpCa + IpK + IbNa + IbCa) + J_stim      pA/pF = mV/ms
// Layers: mid-myocardium gKs 0.098; endocardium gto 0.073 and endocardial 1 (another s gate).
// Restitution, table 2, by its greatest slope 0.7, 1.1 (default), 1.4, 1.8: gKr 0.134, 0.153, 0.172, 0.172; gKs 0.27, 0.392, 0.441, 0.441;
// gpCa 0.0619, 0.1238, 0.3714, 0.8666; gpK 0.073, 0.0146, 0.0073, 0.00219; f_factor 0.6, 1, 1.5, 2 (above 0 mV).
// The time constant of f2 is that of the model's CellML file, with which the benchmark of Niederer et al. 2011,
// doi 10.1098/rsta.2011.0139, and the public trace in tests/reference were made; the paper prints f2_bell_ms 600, f2_centre_mV -25,
// f2_width_mV2 170, f2_low_ms 16. The initial state is the benchmark's. Na and K are kept as changes from their initial concentrations:
// a float of 137 mM could not follow them step by step.
// A cell model is one file: the lines //@ declare it to the host, the functions below are what the kernels call.
//
//@ parameter gNa 14.838 0 150 mS/uF "fast sodium conductance" "ten Tusscher & Panfilov 2006"
//@ parameter gCaL 3.98e-5 0 4e-4 cm3/(ms*uF) "L-type calcium permeability" "ten Tusscher & Panfilov 2006"
//@ parameter gto 0.294 0 3 mS/uF "transient outward conductance; 0.073 in the endocardium" "ten Tusscher & Panfilov 2006"
//@ parameter gKr 0.153 0 2 mS/uF "rapid delayed rectifier conductance" "ten Tusscher & Panfilov 2006"
//@ parameter gKs 0.392 0 4 mS/uF "slow delayed rectifier conductance; 0.098 in the mid-myocardium" "ten Tusscher & Panfilov 2006"
//@ parameter endocardial 0 0 1 1 "0: inactivation s of Ito as in epicardium and mid-myocardium, 1: as in endocardium" "ten Tusscher & Panfilov 2006"
//@ parameter gK1 5.405 0 50 mS/uF "inward rectifier conductance" "ten Tusscher & Panfilov 2006"
//@ parameter gpCa 0.1238 0 2 pA/pF "greatest current of the sarcolemmal calcium pump" "ten Tusscher & Panfilov 2006"
//@ parameter gpK 0.0146 0 0.2 mS/uF "plateau potassium conductance" "ten Tusscher & Panfilov 2006"
//@ parameter gbNa 0.00029 0 0.003 mS/uF "background sodium conductance" "ten Tusscher & Panfilov 2006"
//@ parameter gbCa 0.000592 0 0.006 mS/uF "background calcium conductance" "ten Tusscher & Panfilov 2006"
//@ parameter kNaK 2.724 0 20 pA/pF "greatest current of the sodium-potassium pump" "ten Tusscher & Panfilov 2006"
//@ parameter kNaCa 1000 0 10000 pA/pF "greatest current of the sodium-calcium exchanger" "ten Tusscher & Panfilov 2006"
//@ parameter pKNa 0.03 0 0.2 1 "sodium permeability of IKs relative to potassium" "ten Tusscher & Panfilov 2006"
//@ parameter KmK_mM 1 0.01 20 mM "half saturation of the pump by extracellular potassium" "ten Tusscher et al. 2004"
//@ parameter KmNa_mM 40 1 400 mM "half saturation of the pump by intracellular sodium" "ten Tusscher et al. 2004"
//@ parameter KmNai_mM 87.5 1 800 mM "half saturation of the exchanger by sodium" "ten Tusscher et al. 2004"
//@ parameter KmCa_mM 1.38 0.01 20 mM "half saturation of the exchanger by calcium" "ten Tusscher et al. 2004"
//@ parameter ksat 0.1 0 1 1 "saturation of the exchanger at negative potentials" "ten Tusscher et al. 2004"
//@ parameter exchanger_alpha 2.5 0.1 20 1 "enhances the outward part of the exchanger" "ten Tusscher et al. 2004"
//@ parameter exchanger_gamma 0.35 0 1 1 "place of the exchanger's energy barrier" "ten Tusscher et al. 2004"
//@ parameter KpCa_mM 0.0005 1e-5 0.01 mM "half saturation of the calcium pump" "ten Tusscher et al. 2004"
//@ parameter f_factor 1 0.1 10 1 "scales the time constant of f above 0 mV" "ten Tusscher & Panfilov 2006, table 2"
//@ parameter f2_bell_ms 562 10 2000 ms "height of the bell in the time constant of f2; paper 600" "CellML file of the model, Niederer et al. 2011"
//@ parameter f2_centre_mV -27 -80 20 mV "centre of that bell; paper -25" "CellML file of the model, Niederer et al. 2011"
//@ parameter f2_width_mV2 240 10 2000 mV2 "width of that bell; paper 170" "CellML file of the model, Niederer et al. 2011"
//@ parameter f2_low_ms 80 1 500 ms "time constant of f2 at rest; paper 16" "CellML file of the model, Niederer et al. 2011"
//@ parameter Ko_mM 5.4 1 20 mM "extracellular potassium" "ten Tusscher & Panfilov 2006"
//@ parameter Cao_mM 2 0.1 10 mM "extracellular calcium" "ten Tusscher & Panfilov 2006"
//@ parameter Nao_mM 140 50 250 mM "extracellular sodium" "ten Tusscher & Panfilov 2006"
//@ parameter Ki_mM 136.89 50 200 mM "initial intracellular potassium" "Niederer et al. 2011"
//@ parameter Nai_mM 8.604 1 30 mM "initial intracellular sodium" "Niederer et al. 2011"
//@ parameter temperature_K 310 280 320 K "temperature" "ten Tusscher & Panfilov 2006"
//@ parameter capacitance_uF 0.185 0.01 1 1e-4uF "capacitance in the authors' unit, which turns pA/pF into mM/ms" "ten Tusscher & Panfilov 2006"
//@ parameter Vc 0.016404 0.001 0.1 1e6um3 "cytoplasmic volume" "ten Tusscher & Panfilov 2006"
//@ parameter Vsr 0.001094 1e-4 0.01 1e6um3 "volume of the sarcoplasmic reticulum" "ten Tusscher & Panfilov 2006"
//@ parameter Vss 5.468e-5 1e-5 5e-4 1e6um3 "volume of the dyadic subspace" "ten Tusscher & Panfilov 2006"
//@ parameter Vmaxup 0.006375 0 0.06 mM/ms "greatest uptake into the reticulum" "ten Tusscher & Panfilov 2006"
//@ parameter Kup_mM 0.00025 1e-5 0.005 mM "half saturation of the uptake" "ten Tusscher & Panfilov 2006"
//@ parameter Vrel 0.102 0 1 1/ms "release from the reticulum" "ten Tusscher & Panfilov 2006"
//@ parameter k1 0.15 0.01 2 1/(mM2*ms) "opening of the release channel" "ten Tusscher & Panfilov 2006"
//@ parameter k2 0.045 0.001 1 1/(mM*ms) "inactivation of the release channel" "ten Tusscher & Panfilov 2006"
//@ parameter k3 0.06 0.001 1 1/ms "closing of the release channel" "ten Tusscher & Panfilov 2006"
//@ parameter k4 0.005 0.0001 0.1 1/ms "recovery of the release channel" "ten Tusscher & Panfilov 2006"
//@ parameter EC_mM 1.5 0.1 10 mM "half saturation of the reticulum's influence on the release channel" "ten Tusscher & Panfilov 2006"
//@ parameter max_sr 2.5 1 10 1 "greatest influence of the reticulum's calcium" "ten Tusscher & Panfilov 2006"
//@ parameter min_sr 1 0.1 5 1 "least influence of the reticulum's calcium" "ten Tusscher & Panfilov 2006"
//@ parameter Vleak 0.00036 0 0.01 1/ms "leak from the reticulum" "ten Tusscher & Panfilov 2006"
//@ parameter Vxfer 0.0038 0 0.05 1/ms "diffusion from the subspace to the cytoplasm" "ten Tusscher & Panfilov 2006"
//@ parameter Bufc_mM 0.2 0 2 mM "cytoplasmic calcium buffer" "ten Tusscher & Panfilov 2006"
//@ parameter Kbufc_mM 0.001 1e-4 0.01 mM "half saturation of the cytoplasmic buffer" "ten Tusscher & Panfilov 2006"
//@ parameter Bufsr_mM 10 0 100 mM "calcium buffer of the reticulum" "ten Tusscher & Panfilov 2006"
//@ parameter Kbufsr_mM 0.3 0.01 3 mM "half saturation of the reticulum's buffer" "ten Tusscher & Panfilov 2006"
//@ parameter Bufss_mM 0.4 0 4 mM "calcium buffer of the subspace" "ten Tusscher & Panfilov 2006"
//@ parameter Kbufss_mM 0.00025 1e-5 0.003 mM "half saturation of the subspace's buffer" "ten Tusscher & Panfilov 2006"
//@ parameter resting_mV -85.23 -120 0 mV "initial transmembrane potential" "Niederer et al. 2011"
//@ rest resting_mV
//@ potential -200 200
//@ state Cai 0.000126
//@ state CaSR 3.64
//@ state CaSS 0.00036
//@ state Nai_change 0
//@ state Ki_change 0
//@ state m 0.00172 0 1
//@ state h 0.7444 0 1
//@ state j 0.7045 0 1
//@ state xr1 0.00621 0 1
//@ state xr2 0.4712 0 1
//@ state xs 0.0095 0 1
//@ state r 2.42e-8 0 1
//@ state s 0.999998 0 1
//@ state d 3.373e-5 0 1
//@ state f 0.7888 0 1
//@ state f2 0.9755 0 1
//@ state fcass 0.9953 0 1
//@ state r_prime 0.9073 0 1
//@ derived gNa gNa
//@ derived P_CaL_two_F gCaL
//@ derived gto gto
//@ derived gKr gKr Ko_mM
//@ derived gKs gKs
//@ derived gK1 gK1 Ko_mM
//@ derived gpCa gpCa
//@ derived gpK gpK
//@ derived gbNa gbNa
//@ derived gbCa gbCa
//@ derived NaK kNaK Ko_mM KmK_mM
//@ derived KmNa KmNa_mM
//@ derived NaCa_in kNaCa KmNai_mM Nao_mM KmCa_mM Cao_mM
//@ derived NaCa_out kNaCa KmNai_mM Nao_mM KmCa_mM Cao_mM exchanger_alpha
//@ derived ksat ksat
//@ derived gamma exchanger_gamma
//@ derived KpCa KpCa_mM
//@ derived pKNa pKNa
//@ derived Ki Ki_mM
//@ derived Nai Nai_mM
//@ derived log_Ko Ko_mM
//@ derived log_Nao Nao_mM
//@ derived log_Cao Cao_mM
//@ derived log_KNao Ko_mM pKNa Nao_mM
//@ derived Cao Cao_mM
//@ derived RT_over_F temperature_K
//@ derived F_over_RT temperature_K
//@ derived s_factor endocardial
//@ derived s_centre endocardial
//@ derived s_minus_inverse_width endocardial
//@ derived s_bell endocardial
//@ derived s_slope endocardial
//@ derived s_least endocardial
//@ derived f_factor f_factor
//@ derived f2_bell f2_bell_ms
//@ derived f2_centre f2_centre_mV
//@ derived f2_minus_inverse_width f2_width_mV2
//@ derived f2_low f2_low_ms
//@ derived mM_per_pA capacitance_uF Vc
//@ derived mM_per_pA_subspace capacitance_uF Vss
//@ derived sr_over_c Vsr Vc
//@ derived c_over_ss Vc Vss
//@ derived sr_over_ss Vsr Vss
//@ derived Vmaxup Vmaxup
//@ derived Kup_squared Kup_mM
//@ derived Vrel Vrel
//@ derived k1 k1
//@ derived k2 k2
//@ derived k3 k3
//@ derived k4 k4
//@ derived EC_squared EC_mM
//@ derived max_sr max_sr
//@ derived sr_range max_sr min_sr
//@ derived Vleak Vleak
//@ derived Vxfer Vxfer
//@ derived buffer_c Bufc_mM Kbufc_mM
//@ derived Kbufc Kbufc_mM
//@ derived buffer_sr Bufsr_mM Kbufsr_mM
//@ derived Kbufsr Kbufsr_mM
//@ derived buffer_ss Bufss_mM Kbufss_mM
//@ derived Kbufss Kbufss_mM

void cell_derive(const real *p, real dt, real *d) {
  const real gas = R(8314.472), F = R(96485.3415);  // mJ/(mol K), C/mol: R T / F in mV
  const real Nao = p[P_Nao_mM], Ko = p[P_Ko_mM], Cao = p[P_Cao_mM];
  const real root = sqrt(Ko / R(5.4));
  d[D_gNa] = p[P_gNa];
  d[D_P_CaL_two_F] = p[P_gCaL] * 2 * F;
  d[D_gto] = p[P_gto];
  d[D_gKr] = p[P_gKr] * root;
  d[D_gKs] = p[P_gKs];
  d[D_gK1] = p[P_gK1] * root;
  d[D_gpCa] = p[P_gpCa];
  d[D_gpK] = p[P_gpK];
  d[D_gbNa] = p[P_gbNa];
  d[D_gbCa] = p[P_gbCa];
  d[D_NaK] = p[P_kNaK] * Ko / (Ko + p[P_KmK_mM]);
  d[D_KmNa] = p[P_KmNa_mM];
  const real KmNai = p[P_KmNai_mM];
  const real exchange = p[P_kNaCa] / ((KmNai * KmNai * KmNai + Nao * Nao * Nao) * (p[P_KmCa_mM] + Cao));
  d[D_NaCa_in] = exchange * Cao;
  d[D_NaCa_out] = exchange * Nao * Nao * Nao * p[P_exchanger_alpha];
  d[D_ksat] = p[P_ksat];
  d[D_gamma] = p[P_exchanger_gamma];
  d[D_KpCa] = p[P_KpCa_mM];
  d[D_pKNa] = p[P_pKNa];
  d[D_Ki] = p[P_Ki_mM];
  d[D_Nai] = p[P_Nai_mM];
  d[D_log_Ko] = log(Ko);
  d[D_log_Nao] = log(Nao);
  d[D_log_Cao] = log(Cao);
  d[D_log_KNao] = log(Ko + p[P_pKNa] * Nao);
  d[D_Cao] = Cao;
  d[D_RT_over_F] = gas * p[P_temperature_K] / F;
  d[D_F_over_RT] = F / (gas * p[P_temperature_K]);
  const bool endocardial = p[P_endocardial] > R(0.5);
  d[D_s_factor] = endocardial ? exp(R(5.6)) : exp(R(4.0));
  d[D_s_centre] = endocardial ? R(67.0) : R(45.0);
  d[D_s_minus_inverse_width] = endocardial ? R(-1.0) / 1000 : R(-1.0) / 320;
  d[D_s_bell] = endocardial ? 1000 : 85;
  d[D_s_slope] = endocardial ? 0 : 5;
  d[D_s_least] = endocardial ? 8 : 3;
  d[D_f_factor] = p[P_f_factor];
  d[D_f2_bell] = p[P_f2_bell_ms];
  d[D_f2_centre] = p[P_f2_centre_mV];
  d[D_f2_minus_inverse_width] = -1 / p[P_f2_width_mV2];
  d[D_f2_low] = p[P_f2_low_ms];
  d[D_mM_per_pA] = p[P_capacitance_uF] / (p[P_Vc] * F);
  d[D_mM_per_pA_subspace] = p[P_capacitance_uF] / (2 * p[P_Vss] * F);
  d[D_sr_over_c] = p[P_Vsr] / p[P_Vc];
  d[D_c_over_ss] = p[P_Vc] / p[P_Vss];
  d[D_sr_over_ss] = p[P_Vsr] / p[P_Vss];
  d[D_Vmaxup] = p[P_Vmaxup];
  d[D_Kup_squared] = p[P_Kup_mM] * p[P_Kup_mM];
  d[D_Vrel] = p[P_Vrel];
  d[D_k1] = p[P_k1];
  d[D_k2] = p[P_k2];
  d[D_k3] = p[P_k3];
  d[D_k4] = p[P_k4];
  d[D_EC_squared] = p[P_EC_mM] * p[P_EC_mM];
  d[D_max_sr] = p[P_max_sr];
  d[D_sr_range] = p[P_max_sr] - p[P_min_sr];
  d[D_Vleak] = p[P_Vleak];
  d[D_Vxfer] = p[P_Vxfer];
  d[D_buffer_c] = p[P_Bufc_mM] * p[P_Kbufc_mM];
  d[D_Kbufc] = p[P_Kbufc_mM];
  d[D_buffer_sr] = p[P_Bufsr_mM] * p[P_Kbufsr_mM];
  d[D_Kbufsr] = p[P_Kbufsr_mM];
  d[D_buffer_ss] = p[P_Bufss_mM] * p[P_Kbufss_mM];
  d[D_Kbufss] = p[P_Kbufss_mM];
}

// Measured (tests/results/cell_models.md): with steps of 0.05 ms durations are within 0.2 ms, calcium within 0.3 %, fronts within
// 0.9 %. The upstroke quickens about with the root of the sodium conductance.
real cell_fastest_rate(const real *p) { return R(3.9) * fmax(R(1.0), sqrt(p[P_gNa] / R(14.838))); }

// m after dt ms at the potential v, with e5 = exp(v / 5).
static inline realv ten_tusscher_m(realv m, realv v, realv e5, real dt) {
  const realv closed = 1 + exp((v + R(56.86)) * (-1 / R(9.03))), end = 1 / (closed * closed);
  const realv a = 1 + R(6.14421235332821e-06) / e5, b1 = 1 + R(1096.63315842846) * e5, b2 = 1 + exp((v - 50) * R(0.005));
  return fma(exp(-dt * (10 * a * b1 * b2 / (b1 + b2))), m - end, end);
}

// One step of dt ms. The gates go first, by their exponentials at V (Rush & Larsen 1978): that puts them half a step behind and half a
// step ahead of V, as a leap-frog does. Then V with these gates, its linear part by an exponential too: second order in dt for a
// cell by itself. In tissue diffusion changes V between steps and only m, the one gate as fast as that, would feel it: m goes half
// a step before and half a step after V (measured: the reaction's error in a front's speed falls from 3.9 to 0.4 % at 0.05 ms). stimulus in mV/ms; potassium carries it.
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  const realv v = *V;
  const realv Cai = state[S_Cai], CaSR = state[S_CaSR], CaSS = state[S_CaSS];
  const realv Nai = d[D_Nai] + state[S_Nai_change], Ki = d[D_Ki] + state[S_Ki_change];

  // Exponentials that several rates share.
  const realv e20 = exp(v * R(0.05)), e10 = e20 * e20, e5 = e10 * e10;
  const realv e30 = exp(v * (R(1.0) / 30)), e15 = e30 * e30, e6 = e15 * e15 * e30;
  const realv e14 = exp(v * (R(1.0) / 14)), e7 = e14 * e14;

#define TOWARDS(gate, end, rate) state[S_##gate] = fma(gate_share(dt * (rate)), (end) - state[S_##gate], state[S_##gate])
#define C(x) ((realv)(R(x)))
  state[S_m] = ten_tusscher_m(state[S_m], v, e5, R(0.5) * dt);
  {
    const realv open = 1 + exp((v + R(71.55)) * (1 / R(7.43))), end = 1 / (open * open);
    const intv low = isless(v, C(-40.0)), high = isgreaterequal(v, C(-40.0));
    realv rate_h = 0, rate_j = 0;
    if (ANY(low)) {
      rate_h = R(0.057) * exp((v + 80) * (-1 / R(6.8))) + R(2.7) * exp(v * R(0.079)) + R(3.1e5) * exp(v * R(0.3485));
      const realv opening = (R(-2.5428e4) * exp(v * R(0.2444)) - R(6.948e-6) * exp(v * R(-0.04391))) * (v + R(37.78)) /
                            (1 + exp((v + R(79.23)) * R(0.311)));
      rate_j = opening + R(0.02424) * exp(v * R(-0.01052)) / (1 + exp((v + R(40.14)) * R(-0.1378)));
    }
    if (ANY(high)) {
      const realv high_h = R(5.92307692307692) / (1 + exp((v + R(10.66)) * (-1 / R(11.1))));
      const realv high_j = R(0.6) * exp(v * R(0.057)) * e10 / (e10 + R(0.0407622039783662));
      rate_h = WHERE(low, rate_h, high_h);
      rate_j = WHERE(low, rate_j, high_j);
    }
    state[S_h] = fma(exp(-dt * rate_h), state[S_h] - end, end);  // rates of 1e3 / ms below -140 mV
    TOWARDS(j, end, rate_j);
  }
  // Delayed rectifiers.
  TOWARDS(xr1, e7 / (e7 + R(0.0243728440732796)),
          (1 + C(0.0111089965382423) / e10) * (1 + exp((v + 30) * (1 / R(11.5)))) * (R(1.0) / 2700));
  TOWARDS(xr2, 1 / (1 + exp((v + 88) * (R(1.0) / 24))),
          (1 + C(0.0497870683678639) / e20) * (1 + C(0.0497870683678639) * e20) * (R(1.0) / R(3.36)));
  {
    const realv q = 1 + C(2.30097589089283) / e6, b = 1 + C(0.0969719678644051) * e15;
    TOWARDS(xs, e14 / (e14 + R(0.69967253737513)), 1 / (1400 * rsqrt(q) / b + 80));
  }
  // Transient outward current.
  {
    const realv x = v + 40, y = v + d[D_s_centre];
    TOWARDS(r, e6 / (e6 + R(28.0316248945261)), 1 / (R(9.5) * exp(x * x * (R(-1.0) / 1800)) + R(0.8)));
    TOWARDS(s, 1 / (1 + d[D_s_factor] * e5),
            1 / (d[D_s_bell] * exp(y * y * d[D_s_minus_inverse_width]) + d[D_s_slope] / (1 + R(0.0183156388887342) * e5) +
                 d[D_s_least]));
  }
  // L-type calcium current.
  {
    const realv e7_5 = e15 * e15, x = v + 27, y = v - d[D_f2_centre];
    const realv tau_d = (R(1.4) / (1 + exp((v + 35) * (R(-1.0) / 13))) + R(0.25)) * R(1.4) / (1 + R(2.71828182845905) * e5) +
                        e20 / (e20 + R(12.1824939607035));
    TOWARDS(d, e7_5 / (e7_5 + R(0.344153786865412)), 1 / tau_d);
    const realv falling = 1 / (1 + R(20.0855369231877) * e10);
    const realv tau_f = R(1102.5) * exp(x * x * (R(-1.0) / 225)) + 200 * e10 / (e10 + R(3.66929666761924)) + 180 * falling + 20;
    TOWARDS(f, 1 / (1 + R(17.4117080633277) * e7), 1 / WHERE(isgreater(v, C(0.0)), d[D_f_factor] * tau_f, tau_f));
    TOWARDS(f2, R(0.67) / (1 + R(148.413159102577) * e7) + R(0.33),
            1 / (d[D_f2_bell] * exp(y * y * d[D_f2_minus_inverse_width]) + 31 * e10 / (e10 + R(12.1824939607035)) +
                 d[D_f2_low] * falling));
    const realv bound = 1 / fma(CaSS * 20, CaSS * 20, 1);
    TOWARDS(fcass, R(0.6) * bound + R(0.4), 1 / (80 * bound + 2));
  }
  // Release channel of the reticulum.
  const realv CaSR_squared = CaSR * CaSR;
  const realv k_sr = d[D_max_sr] - d[D_sr_range] * CaSR_squared / (CaSR_squared + d[D_EC_squared]);
  {
    const realv rate = d[D_k4] + d[D_k2] * k_sr * CaSS;
    TOWARDS(r_prime, d[D_k4] / rate, rate);
  }
#undef C
#undef TOWARDS

  // Currents, pA/pF.
  const realv RTF = d[D_RT_over_F];
  const realv log_Ki = log(Ki), log_Nai = log(Nai);
  const realv v_K = v - RTF * (d[D_log_Ko] - log_Ki), v_Na = v - RTF * (d[D_log_Nao] - log_Nai);
  const realv v_Ks = v - RTF * (d[D_log_KNao] - log(Ki + d[D_pKNa] * Nai));
  const realv v_Ca = v - R(0.5) * RTF * (d[D_log_Cao] - log(Cai));
  const realv u = v * d[D_F_over_RT], e_u = exp(-u);

  const realv m = state[S_m], xs = state[S_xs];
  const realv g_Na = d[D_gNa] * m * m * m * state[S_h] * state[S_j];
  const realv g_to = d[D_gto] * state[S_r] * state[S_s], g_Kr = d[D_gKr] * state[S_xr1] * state[S_xr2];
  const realv g_Ks = d[D_gKs] * xs * xs;

  const realv x = 2 * (v - 15) * d[D_F_over_RT], B = over_expm1(x, exp(x));
  const realv ICaL = d[D_P_CaL_two_F] * state[S_d] * state[S_f] * state[S_f2] * state[S_fcass] *
                     (R(0.25) * CaSS * (x + B) - d[D_Cao] * B);
  // Inward rectifier: a / (a + b) with a = 0.1 / (1 + e06), b = (3 e0002 + e01) / (1 + e05).
  const realv w = fmax(v_K, (realv)(R(-160.0))), minus_tenth = exp(R(-0.1) * w), square = minus_tenth * minus_tenth;
  const realv e05 = square * square * minus_tenth, e06 = exp(R(0.06) * (w - 200)), z = R(0.0002) * (w + 100);
  const realv e0002 = 1 + z * (1 + z * (R(0.5) + z * (R(1.0) / 6 + z * (R(1.0) / 24))));
  const realv a = R(0.1) * (1 + e05), b = (1 + e06) * (3 * e0002 + R(0.367879441171442) / minus_tenth);
  const realv IK1 = d[D_gK1] * a / (a + b) * v_K;
  const realv IpK = d[D_gpK] * v_K / (1 + exp((25 - v) * (1 / R(5.98))));

  const realv e_in = exp(d[D_gamma] * u), e_out = e_in * e_u;
  const realv INaCa = (d[D_NaCa_in] * e_in * Nai * Nai * Nai - d[D_NaCa_out] * e_out * Cai) / (1 + d[D_ksat] * e_out);
  const realv INaK = d[D_NaK] * Nai / ((Nai + d[D_KmNa]) * (1 + R(0.1245) * exp(R(-0.1) * u) + R(0.0353) * e_u));
  const realv IpCa = d[D_gpCa] * Cai / (Cai + d[D_KpCa]);
  const realv INa = g_Na * v_Na, IbNa = d[D_gbNa] * v_Na, IbCa = d[D_gbCa] * v_Ca;
  const realv IK = fma(g_to + g_Kr, v_K, fma(g_Ks, v_Ks, IK1 + IpK));

  const realv total = stimulus - (INa + IbNa + ICaL + IbCa + INaCa + INaK + IpCa + IK);
  const realv z_V = dt * (g_Na + g_to + g_Kr + g_Ks);
  *V = fma(dt / fma(z_V, fma(z_V, (realv)(R(1.0) / 12), (realv)(R(0.5))), (realv)(1)), total, v);

  // Concentrations, mM.
  const realv scale = dt * d[D_mM_per_pA];
  state[S_Nai_change] -= scale * (INa + IbNa + 3 * (INaK + INaCa));
  state[S_Ki_change] -= scale * (IK - 2 * INaK - stimulus);

  const realv k1_Ca = d[D_k1] * CaSS, k3 = d[D_k3] * k_sr, inverse = 1 / fma(k1_Ca, CaSS, k3);
  const realv release = d[D_Vrel] * state[S_r_prime] * k1_Ca * inverse;
  const realv Irel = release * CaSS * (CaSR - CaSS);
  const realv Ileak = d[D_Vleak] * (CaSR - Cai), Cai_squared = Cai * Cai;
  const realv Iup = d[D_Vmaxup] * Cai_squared / (Cai_squared + d[D_Kup_squared]);
  const realv Ixfer = d[D_Vxfer] * (CaSS - Cai);
  const realv c = Cai + d[D_Kbufc], cs = CaSR + d[D_Kbufsr], css = CaSS + d[D_Kbufss];
  const realv free_c = c * c / (c * c + d[D_buffer_c]), free_sr = cs * cs / (cs * cs + d[D_buffer_sr]);
  state[S_CaSR] = fma(dt * free_sr, Iup - Irel - Ileak, CaSR);
  state[S_Cai] = fma(dt * free_c,
                     R(0.5) * d[D_mM_per_pA] * (2 * INaCa - IbCa - IpCa) + d[D_sr_over_c] * (Ileak - Iup) + Ixfer, Cai);
  // The subspace, where calcium releases more calcium: exponential Euler with the slope of the whole right-hand side.
  const realv bound_ss = 1 / (css * css + d[D_buffer_ss]), free_ss = css * css * bound_ss;
  const realv flux = d[D_sr_over_ss] * Irel - d[D_c_over_ss] * Ixfer - d[D_mM_per_pA_subspace] * ICaL;
  const realv slope = d[D_sr_over_ss] * release * (2 * k3 * inverse * (CaSR - CaSS) - CaSS) - d[D_c_over_ss] * d[D_Vxfer];
  const realv z_ss = dt * fma(free_ss, slope, 2 * css * d[D_buffer_ss] * bound_ss * bound_ss * flux);
  state[S_CaSS] =
      fma(dt * free_ss / fma(z_ss, fma(z_ss, (realv)(R(1.0) / 12), (realv)(R(-0.5))), (realv)(1)), flux, CaSS);
  state[S_m] = ten_tusscher_m(state[S_m], *V, exp(*V * R(0.2)), R(0.5) * dt);
}
