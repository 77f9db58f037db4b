// Lead currents at the cells: what a unit current between a lead's electrodes drives through the tissue. Needs segments.clh,
// lead_field.clh and -D ELECTRODES_A_PASS.

// currents (ELECTRODES_A_PASS, 3, stride): sigma_i grad Z of electrodes from first_electrode on, times the scale of
// `conductivity` (6, stride), xx yy zz xy xz yz. first: first cell of the member.
kernel void sample_leads(LEAD_FIELD_ARGUMENTS, const real4 origin_and_spacing,
                         global const int *restrict first_cell, global const uchar *restrict tissue_region_of,
                         global const real *restrict conductivity, global real *restrict currents, const int stride,
                         const int first, const int first_electrode) {
  const int i = first + get_global_id(0);
  const bool tissue = tissue_region_of[i] != NO_REGION;
  real D[6];
  for (int c = 0; c < 6; ++c) D[c] = conductivity[i + c * (size_t)stride];
  const real3 p = cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz,
                              origin_and_spacing.w);
  for (int e = 0; e < ELECTRODES_A_PASS; ++e) {
    const real3 g = tissue ? LEAD_GRADIENT(first_electrode + e, p) : (real3)(0, 0, 0);
    global real *J = currents + i + 3 * e * (size_t)stride;
    J[0] = D[0] * g.x + D[3] * g.y + D[4] * g.z;
    J[(size_t)stride] = D[3] * g.x + D[1] * g.y + D[5] * g.z;
    J[2 * (size_t)stride] = D[4] * g.x + D[5] * g.y + D[2] * g.z;
  }
}
