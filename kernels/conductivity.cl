// Conductivity tensor sigma_t I + (sigma_l - sigma_t) f f^T of each cell, times `scale`. Thesis, equation (sigma1).
// With `membrane` it is divided by chi Cm, which makes it a diffusivity.
// Region r has its sigma_l at parameter REGION_FIRST + REGION_STRIDE region_slot[r] + offset, its sigma_t behind it.
// a bath is isotropic, at parameter bath_parameter[r].
// Needs segments.clh, and region_slot[], bath_parameter[] (generated).

constant int plaquette_axes[3][2] = {{0, 1}, {0, 2}, {1, 2}};  // xy, xz, yz

kernel void conductivity_tensor(global const real *restrict parameters, global const ushort *restrict member_of,
                                global const uchar *restrict tissue_region_of, global const real *restrict fibre,
                                global real *restrict conductivity, const int stride, const int offset,
                                const real scale, const int membrane) {
  const int i = get_global_id(0);
  real tensor[6] = {0, 0, 0, 0, 0, 0};
  const int region = tissue_region_of[i];
  if (region != NO_REGION) {
    const int bath = bath_parameter[region];
    const int first = bath >= 0 ? bath : REGION_FIRST + REGION_STRIDE * region_slot[region] + offset;
    global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
    const real factor = membrane ? scale / (P[PARAM_electrophysiology_surface_to_volume_per_mm] *
                                            P[PARAM_electrophysiology_capacitance_uF_per_mm2])
                                 : scale;
    const real along = factor * P[first], across = bath >= 0 ? along : factor * P[first + 1];
    const real f[3] = {fibre[i], fibre[i + (size_t)stride], fibre[i + 2 * (size_t)stride]};
    for (int a = 0; a < 3; ++a) tensor[a] = across + (along - across) * f[a] * f[a];
    for (int o = 0; o < 3; ++o)
      tensor[3 + o] = (along - across) * f[plaquette_axes[o][0]] * f[plaquette_axes[o][1]];
  }
  for (int c = 0; c < 6; ++c) conductivity[i + c * (size_t)stride] = tensor[c];
}
