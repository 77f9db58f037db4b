// Holzapfel & Ogden 2009, Phil. Trans. R. Soc. A 367:3445, as in Arostica et al. 2025, Comput. Methods Appl. Mech. Eng. 435:117485:
//   W = a/(2b) (e^(b (I1_bar - 3)) - 1) + sum over i = f, s of a_i/(2b_i) X(I4i - 1) (e^(b_i (I4i - 1)^2) - 1)
//       + a_fs/(2b_fs) (e^(b_fs I8fs^2) - 1),   X(x) = 1 / (1 + e^(-k x)), k = 100
// with I1 isochoric and I4f = f.C f, I4s = s.C s, I8fs = f.C s of C itself. X and its slope are both in the stress, so that it has an energy;
// W is therefore not convex along a fibre shortened by 0.4 to 1.8 %, where the tangent falls to -0.64 a_f (2 a_f at rest): so the
// benchmark defines it.
// The benchmark's volumetric energy is kappa/4 (J^2 - 1 - 2 ln J): law_pressure, which an element may take at its mean J instead of
// kappa (J - 1). Both have bulk modulus kappa at rest; their pressures differ by a share (J - 1) / (2 J), 2.5 % at J = 1.05,
// and the J that carries a pressure p by (p / kappa)^2 / 2.
//
//@ sheets 1
//@ parameter a_kPa 0.059 1e-5 1000 kPa "stiffness of the ground substance" "Holzapfel & Ogden 2009, table 1"
//@ parameter b 8.023 1e-3 200 1 "exponent of the ground substance" "Holzapfel & Ogden 2009, table 1"
//@ parameter a_f_kPa 18.472 0 1e4 kPa "stiffness of fibres under tension" "Holzapfel & Ogden 2009, table 1"
//@ parameter b_f 16.026 1e-3 500 1 "exponent of fibres" "Holzapfel & Ogden 2009, table 1"
//@ parameter a_s_kPa 2.481 0 1e4 kPa "stiffness of sheets under tension" "Holzapfel & Ogden 2009, table 1"
//@ parameter b_s 11.12 1e-3 500 1 "exponent of sheets" "Holzapfel & Ogden 2009, table 1"
//@ parameter a_fs_kPa 0.216 0 1e4 kPa "stiffness of shear between fibres and sheets" "Holzapfel & Ogden 2009, table 1"
//@ parameter b_fs 11.436 1e-3 500 1 "exponent of that shear" "Holzapfel & Ogden 2009, table 1"

#define HEAVISIDE_STEEPNESS 100

/// One family of fibres: energy as a function of x = I4 - 1, with its first and second derivative.
static inline real fibre_energy(real x, real a, real b, real *first, real *second) {
  real growth;
  const real k = HEAVISIDE_STEEPNESS, q = b * x * x;
  const real whole = bounded_exp(q, &growth) - 1;
  const real on = 1 / (1 + exp(-clamp(k * x, R(-80.0), R(80.0)))), on_slope = k * on * (1 - on);
  const real scale = a / (2 * b), slope = 2 * b * x * growth, curvature = 2 * b * growth * (1 + 2 * q);
  *first = scale * (on_slope * whole + on * slope);
  *second = scale * (k * on_slope * (1 - 2 * on) * whole + 2 * on_slope * slope + on * curvature);
  return scale * on * whole;
}

/// a/(2b) (e^q - 1), *growth = e^q.
static inline real ground_energy(real q, real a, real b, real *growth) {
  return a / (2 * b) * (bounded_exp(q, growth) - 1);
}

symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope, growth, along_f, along_s, second;
  const real j = isochoric_scale(J, &slope);
  ground_energy(M[M_b] * (j * j * sym_trace(C) - 3), M[M_a_kPa], M[M_b], &growth);
  const real ground = M[M_a_kPa] * growth;
  const symmetric S_bar = {ground, ground, ground, 0, 0, 0};
  const real3 Cf = sym_times(C, f), Cs = sym_times(C, s);
  const real I8 = dot(f, Cs);
  fibre_energy(dot(f, Cf) - 1, M[M_a_f_kPa], M[M_b_f], &along_f, &second);
  fibre_energy(dot(s, Cs) - 1, M[M_a_s_kPa], M[M_b_s], &along_s, &second);
  bounded_exp(M[M_b_fs] * I8 * I8, &growth);
  symmetric S = isochoric_stress(C, J, S_bar, j, slope);
  S = sym_fma(2 * along_f, sym_square(f), S);
  S = sym_fma(2 * along_s, sym_square(s), S);
  return sym_fma(2 * M[M_a_fs_kPa] * I8 * growth, sym_product(f, s), S);
}

real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope, growth, first, second;
  const real j = isochoric_scale(J, &slope), I8 = dot(f, sym_times(C, s));
  return ground_energy(M[M_b] * (j * j * sym_trace(C) - 3), M[M_a_kPa], M[M_b], &growth) +
         fibre_energy(dot(f, sym_times(C, f)) - 1, M[M_a_f_kPa], M[M_b_f], &first, &second) +
         fibre_energy(dot(s, sym_times(C, s)) - 1, M[M_a_s_kPa], M[M_b_s], &first, &second) +
         ground_energy(M[M_b_fs] * I8 * I8, M[M_a_fs_kPa], M[M_b_fs], &growth);
}

// Term by term: 4 W'' (f.H f)^2 <= 4 W'' I4f, and for I8 the larger eigenvalue of the metric between f and s.
real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope, growth, first, second_f, second_s;
  const real j = isochoric_scale(J, &slope);
  ground_energy(M[M_b] * (j * j * sym_trace(C) - 3), M[M_a_kPa], M[M_b], &growth);
  principal_tangent t = tangent_of(C, J);
  add_first_invariant(&t, R(0.5) * M[M_a_kPa] * growth, R(0.5) * M[M_a_kPa] * M[M_b] * growth);
  const real3 Cf = sym_times(C, f), Cs = sym_times(C, s);
  const real I4f = dot(f, Cf), I4s = dot(s, Cs), I8 = dot(f, Cs);
  fibre_energy(I4f - 1, M[M_a_f_kPa], M[M_b_f], &first, &second_f);
  fibre_energy(I4s - 1, M[M_a_s_kPa], M[M_b_s], &first, &second_s);
  const real q = M[M_b_fs] * I8 * I8, apart = R(0.5) * (I4f - I4s);
  bounded_exp(q, &growth);
  const real metric = R(0.5) * (I4f + I4s) + sqrt(apart * apart + I8 * I8), shear = M[M_a_fs_kPa] * growth;
  // W''(I8) I8-metric, and its first derivative has no second variation: I8 is linear in C.
  return isotropic_stiffness(&t) + 4 * (fmax(second_f, R(0.0)) * I4f + fmax(second_s, R(0.0)) * I4s) + shear * (1 + 2 * q) * metric;
}

#define LAW_PRESSURE 1
/// dU/dJ of the benchmark's volumetric energy at bulk modulus kappa; below J = 0.1 its tangent.
real law_pressure(real J, real kappa) {
  const real kept = fmax(J, R(0.1));
  return R(0.5) * kappa * (kept - 1 / kept + (J - kept) * (1 + 1 / (kept * kept)));
}
/// U itself.
real law_volume_energy(real J, real kappa) {
  const real kept = fmax(J, R(0.1)), beyond = J - kept;
  return R(0.25) * kappa * (kept * kept - 1 - 2 * log(kept)) +
         R(0.5) * kappa * beyond * (kept - 1 / kept + R(0.5) * beyond * (1 + 1 / (kept * kept)));
}
