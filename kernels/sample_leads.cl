// Lead fields at the cells. Needs segments.clh, lead_field.clh.

// Independent leads from electrodes RA LA LL V1 ... V6: I, II, V1 to V6 against Wilson's terminal.
// potentials (LEADS, stride) mV/uA.
kernel void sample_leads(LEAD_FIELD_ARGUMENTS, const real4 origin_and_spacing,
                         global const int *restrict first_cell, global const uchar *restrict tissue_region_of,
                         global real *restrict potentials, const int stride, const int first) {
  const int i = first + get_global_id(0);
  real Z[9];
  for (int e = 0; e < 9; ++e) Z[e] = 0;
  if (tissue_region_of[i] != NO_REGION) {
    const real3 p = cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz,
                                origin_and_spacing.w);
    for (int e = 0; e < 9; ++e) Z[e] = LEAD_POTENTIAL(e, p);
  }
  const real wilson = (Z[0] + Z[1] + Z[2]) / 3;
  potentials[i] = Z[1] - Z[0];
  potentials[i + (size_t)stride] = Z[2] - Z[0];
  for (int v = 0; v < 6; ++v) potentials[i + (2 + v) * (size_t)stride] = Z[3 + v] - wilson;
}
