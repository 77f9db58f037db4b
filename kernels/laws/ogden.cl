// Ogden 1972, Proc. R. Soc. A 326:565, three terms of the isochoric principal stretches (Holzapfel 2000, section 6.5):
//   W = sum_k mu_k / alpha_k (l1^alpha_k + l2^alpha_k + l3^alpha_k - 3),  l_i = J^(-1/3) lambda_i
// The shear modulus at rest is half the sum of mu_k alpha_k. The default is the rubber of Ogden's paper, far stiffer than a heart; a
// term without mu is absent. Principal directions come from Jacobi's method, so equal stretches are like any others.
//
//@ sheets 0
//@ parameter mu1_kPa 29.8 -1e6 1e6 kPa "factor of the first power" "Ogden 1972 (rubber), in Holzapfel 2000, section 6.5, scaled to a shear modulus of 20 kPa"
//@ parameter alpha1 1.3 -30 30 1 "exponent of the first power" "Ogden 1972 (rubber), in Holzapfel 2000, section 6.5, scaled to a shear modulus of 20 kPa"
//@ parameter mu2_kPa 0.057 -1e6 1e6 kPa "factor of the second power" "Ogden 1972 (rubber), in Holzapfel 2000, section 6.5, scaled to a shear modulus of 20 kPa"
//@ parameter alpha2 5 -30 30 1 "exponent of the second power" "Ogden 1972 (rubber), in Holzapfel 2000, section 6.5, scaled to a shear modulus of 20 kPa"
//@ parameter mu3_kPa -0.47 -1e6 1e6 kPa "factor of the third power" "Ogden 1972 (rubber), in Holzapfel 2000, section 6.5, scaled to a shear modulus of 20 kPa"
//@ parameter alpha3 -2 -30 30 1 "exponent of the third power" "Ogden 1972 (rubber), in Holzapfel 2000, section 6.5, scaled to a shear modulus of 20 kPa"

#define OGDEN_TERMS 3
// mu and alpha of term k; an exponent of 0 stands for its limit, where the power is a logarithm without effect on shape.
#define OGDEN_MU(k) M[M_mu1_kPa + 2 * (k)]
#define OGDEN_ALPHA(k) M[M_alpha1 + 2 * (k)]

symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope, c[3];
  real3 n[3];
  const real j = isochoric_scale(J, &slope);
  sym_eigen(C, c, n);
  symmetric S_bar = {0, 0, 0, 0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    const real half_log = R(0.5) * log(fmax(j * j * c[i], R(1e-6)));  // of the stretch
    real S = 0;
    for (int k = 0; k < OGDEN_TERMS; ++k) S += OGDEN_MU(k) * exp((OGDEN_ALPHA(k) - 2) * half_log);
    S_bar = sym_fma(S, sym_square(n[i]), S_bar);
  }
  return isochoric_stress(C, J, S_bar, j, slope);
}

real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope, c[3], W = 0;
  real3 n[3];
  const real j = isochoric_scale(J, &slope);
  sym_eigen(C, c, n);
  for (int i = 0; i < 3; ++i) {
    const real half_log = R(0.5) * log(fmax(j * j * c[i], R(1e-6)));
    for (int k = 0; k < OGDEN_TERMS; ++k)
      if (OGDEN_ALPHA(k) != 0) W += OGDEN_MU(k) / OGDEN_ALPHA(k) * expm1(OGDEN_ALPHA(k) * half_log);
  }
  return W;
}

real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  principal_tangent t = tangent_of(C, J);
  real log_c[3];
  for (int i = 0; i < 3; ++i) log_c[i] = log(t.c[i]);
  for (int k = 0; k < OGDEN_TERMS; ++k)
    if (OGDEN_ALPHA(k) != 0) add_power(&t, OGDEN_MU(k), OGDEN_ALPHA(k), log_c);
  return isotropic_stiffness(&t);
}
