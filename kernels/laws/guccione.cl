// Guccione, McCulloch & Waldman 1991, J. Biomech. Eng. 113:42, as in Land et al. 2015, Proc. R. Soc. A 471:20150641, eq. 2.2:
//   W = C/2 (exp(Q) - 1), Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2), E = (C - I) / 2,
// not split into isochoric and volumetric parts: with a split Land's second problem depends on the bulk modulus. What stands in
// the paper in components is here without a frame: with e = E f, Q = bt E:E + 2 (bfs - bt) e.e + (bf + bt - 2 bfs) (f.e)^2.
//
//@ sheets 0
//@ parameter C_kPa 4 1e-4 1000 kPa "stiffness of the exponential law" "chosen: gives physiological loops with the default heart"
//@ parameter bf 8 0.01 200 1 "exponent along fibres" "Land et al. 2015, problem 3"
//@ parameter bt 3 0.01 200 1 "exponent across fibres" "Land et al. 2015, problem 3 (2); 3: measured with the default heart"
//@ parameter bfs 4 0.01 200 1 "exponent of shear between fibres and what is across" "Land et al. 2015, problem 3"

// The step may be bounded by waves along the grid's axes (solid_measure.cl): with fibres along, across and oblique to the grid, stretched and at
// random, the true limit is not met (tests/verification/solid_step.cpp). Stiffer exponents, as Holzapfel-Ogden's, run away with that.
#define LAW_ALONG_AXES

/// Q and half of dQ/dE.
static inline real guccione_exponent(symmetric C, real3 f, global const real *M, symmetric *half_slope) {
  const symmetric E = sym_scaled(R(0.5), sym_plus_identity(C, -1));
  const real3 e = sym_times(E, f);
  const real along = dot(f, e), bt = M[M_bt], mixed = 2 * (M[M_bfs] - bt), fibre = M[M_bf] + bt - 2 * M[M_bfs];
  const symmetric sum = sym_fma(mixed, sym_product(e, f), sym_scaled(bt, E));
  *half_slope = sym_fma(fibre * along, sym_square(f), sum);
  return sym_contract(*half_slope, E);
}

symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  symmetric half_slope;
  real growth;
  bounded_exp(guccione_exponent(C, f, M, &half_slope), &growth);
  return sym_scaled(M[M_C_kPa] * growth, half_slope);
}

real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  symmetric half_slope;
  real growth;
  const real Q = guccione_exponent(C, f, M, &half_slope);
  return R(0.5) * M[M_C_kPa] * (Q < 1 ? expm1(Q) : bounded_exp(Q, &growth) - 1);
}

// D = C e^Q (A + 2 n (x) n) with n = A E. A has no larger eigenvalue than the largest exponent, and the square of n : H = N . n F^T m is at most
// the largest eigenvalue of n C n.
real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  symmetric half_slope;
  real growth;
  bounded_exp(guccione_exponent(C, f, M, &half_slope), &growth);
  const real largest = fmax(M[M_bf], fmax(M[M_bt], M[M_bfs]));
  return M[M_C_kPa] * growth *
         (largest * sym_largest(C) + 2 * fmax(sym_largest(sym_sandwich(half_slope, C)), R(0.0)));
}
