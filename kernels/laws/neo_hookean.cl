// Neo-Hookean solid of the isochoric invariant: W = mu/2 (I1_bar - 3). Holzapfel 2000, Nonlinear Solid Mechanics, section 6.5.
//
//@ sheets 0
//@ parameter mu_kPa 20 1e-4 1e5 kPa "shear modulus" "measured: a shear modulus of 20 kPa carries the default twitch (2, the thesis's, is pressed together by it)"

symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope;
  const real j = isochoric_scale(J, &slope), mu = M[M_mu_kPa];
  const symmetric S_bar = {mu, mu, mu, 0, 0, 0};
  return isochoric_stress(C, J, S_bar, j, slope);
}

real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope;
  const real j = isochoric_scale(J, &slope);
  return R(0.5) * M[M_mu_kPa] * (j * j * sym_trace(C) - 3);
}

real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  principal_tangent t = tangent_of(C, J);
  add_first_invariant(&t, R(0.5) * M[M_mu_kPa], 0);
  return isotropic_stiffness(&t);
}
