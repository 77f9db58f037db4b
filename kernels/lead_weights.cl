// Weights of the ECG: lead(t) = sum_i w_i V_i. With the potential Z of a lead's unit current, reciprocity gives
//     lead = integral Z div(sigma_i grad V) = integral V div(sigma_i grad Z)      (zero flux of sigma_i grad V),
// so w is the diffusion operator of sigma_i, over tissue-to-tissue faces only, applied to Z at the cell centres.
// McFee & Johnston 1953, Circulation 8:554; Geselowitz 1989, Proc. IEEE 77:857. Needs segments.clh, diffusion.clh,
// lead_field.clh.

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

// weights (LEADS, stride), dimensionless: mV of the lead by mV of the cell.
kernel void lead_weights(global const real *restrict potentials, global const real *restrict stencil,
                         global const int8 *restrict neighbours, global real *restrict weights, const int stride) {
  const int i = THIS_CELL;
  const Rows rows = neighbour_rows(neighbours, i);
  for (int q = 0; q < LEADS; ++q) {
    const size_t row = q * (size_t)stride;
    STORE(diffusion(potentials + row, stencil, stride, rows, i), weights + row + i);
  }
}
