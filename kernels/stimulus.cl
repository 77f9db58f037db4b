// Which stimuli reach which tissue cells. Needs segments.clh and stimulus.clh.
kernel void mark_stimuli(global const real *restrict stimuli, const real4 origin_and_spacing,
                         global const int *restrict first_cell, global const ushort *restrict member_of,
                         global const uchar *restrict tissue_region_of, global uchar *restrict stimulated_by) {
  const int i = get_global_id(0), s = i / LANES;
  uchar mask = 0;
  if (tissue_region_of[i] != NO_REGION) {
    const real3 p = cell_centre(first_cell[s] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz, origin_and_spacing.w);
    mask = stimulus_mask(p, stimuli + member_of[s] * STIMULI * STIMULUS_NUMBERS);
  }
  stimulated_by[i] = mask;
}
