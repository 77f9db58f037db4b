// Mooney 1940, J. Appl. Phys. 11:582; Rivlin 1948, Phil. Trans. R. Soc. A 241:379; with isochoric invariants (Holzapfel 2000, section
// 6.5): W = c1 (I1_bar - 3) + c2 (I2_bar - 3). The shear modulus at rest is 2 (c1 + c2); one of the two may be negative.
//
//@ sheets 0
//@ parameter c1_kPa 5 -1e5 1e5 kPa "factor of the first invariant" "measured: a shear modulus of 20 kPa carries the default twitch (2, the thesis's, is pressed together by it)"
//@ parameter c2_kPa 5 -1e5 1e5 kPa "factor of the second invariant" "measured: a shear modulus of 20 kPa carries the default twitch (2, the thesis's, is pressed together by it)"

symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope;
  const real j = isochoric_scale(J, &slope), g = j * j, c1 = M[M_c1_kPa], c2 = M[M_c2_kPa];
  const symmetric S_bar = sym_plus_identity(sym_scaled(-2 * c2 * g, C), 2 * (c1 + c2 * g * sym_trace(C)));
  return isochoric_stress(C, J, S_bar, j, slope);
}

real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  real slope;
  const real j = isochoric_scale(J, &slope), g = j * j, I1 = sym_trace(C);
  const real I2 = R(0.5) * (I1 * I1 - sym_contract(C, C));
  return M[M_c1_kPa] * (g * I1 - 3) + M[M_c2_kPa] * (g * g * I2 - 3);
}

real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  principal_tangent t = tangent_of(C, J);
  add_first_invariant(&t, M[M_c1_kPa], 0);
  add_second_invariant(&t, M[M_c2_kPa]);
  return isotropic_stiffness(&t);
}
