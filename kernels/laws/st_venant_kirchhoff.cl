// Saint Venant and Kirchhoff's solid: W = lambda/2 (tr E)^2 + mu E:E, S = lambda tr(E) I + 2 mu E. Holzapfel 2000, section 6.5.
// Linear in E, so it collapses under compression: along an axis the force lambda_1 S_11 falls again below a stretch of 1/sqrt(3) = 0.58, and nothing
// resists at 0. For small and moderate strains alone. The element's bulk modulus is added to lambda.
//
//@ sheets 0
//@ parameter lambda_kPa 0 -1e5 1e6 kPa "Lame's first constant, beside the element's bulk modulus" "chosen"
//@ parameter mu_kPa 20 1e-4 1e5 kPa "shear modulus, Lame's second constant" "measured: a shear modulus of 20 kPa carries the default twitch (2, the thesis's, is pressed together by it)"

symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  const real mu = M[M_mu_kPa];
  return sym_plus_identity(sym_scaled(mu, C), R(0.5) * M[M_lambda_kPa] * (sym_trace(C) - 3) - mu);
}

real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  const symmetric E = sym_scaled(R(0.5), sym_plus_identity(C, -1));
  const real trace = sym_trace(E);
  return R(0.5) * M[M_lambda_kPa] * trace * trace + M[M_mu_kPa] * sym_contract(E, E);
}

// H : D : H = lambda (a.N)^2 + mu (a.a + (a.N)^2) with a = F^T m.
real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  return (M[M_mu_kPa] + fmax(M[M_lambda_kPa] + M[M_mu_kPa], R(0.0))) * sym_largest(C);
}
