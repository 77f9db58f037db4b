// Initial states and derived constants of the cell model, member by member and, where a parameter differs between
// regions, cell by cell. Needs segments.clh, a cell model, and
// -D CELL_PARAMETERS, CELL_DERIVED, CELL_STATES, CELL_FIRST (parameter index of the model's first parameter),
//    PARAMETERS, REGION_FIRST, REGION_STRIDE, REGION_CELL_OFFSET, region_slot[] and derived_field[] (generated:
//    for each derived constant the number of its field, or -1), INITIAL_STATES (initialiser), REST (index of the
//    resting potential among the model's parameters).
#if !defined(CELL_PARAMETERS) || !defined(CELL_FIRST) || !defined(REGION_CELL_OFFSET)
#error "cell_setup.cl needs CELL_PARAMETERS, CELL_FIRST, REGION_CELL_OFFSET"
#endif

// derived (members, CELL_DERIVED); fastest_rate (members) 1/ms: the largest over the member's regions.
kernel void derive_members(global const real *restrict parameters, global real *restrict derived,
                           global real *restrict fastest_rate, const real dt) {
  const int member = get_global_id(0);
  global const real *P = parameters + (size_t)member * PARAMETERS;
  real p[CELL_PARAMETERS], d[CELL_DERIVED];
  for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = P[CELL_FIRST + k];
  cell_derive(p, dt, d);
  for (int k = 0; k < CELL_DERIVED; ++k) derived[member * CELL_DERIVED + k] = d[k];
  real fastest = 0;
  for (int slot = 0; slot < REGION_SLOTS; ++slot) {
    for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = P[REGION_FIRST + REGION_STRIDE * slot + REGION_CELL_OFFSET + k];
    fastest = fmax(fastest, cell_fastest_rate(p));
  }
  fastest_rate[member] = fastest;
}

// derived_fields (fields, stride), V (stride), states (CELL_STATES, stride), activation (stride).
kernel void initialise_cells(global const real *restrict parameters, global const ushort *restrict member_of,
                             global const uchar *restrict tissue_region_of, global real *restrict derived_fields,
                             global real *restrict V, global real *restrict V_other, global real *restrict states,
                             global float *restrict activation, const int stride, const real dt) {
  const int i = get_global_id(0);
  const real initial[CELL_STATES] = INITIAL_STATES;
  global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
  const int region = tissue_region_of[i];
  const int first =
      region == NO_REGION ? CELL_FIRST : REGION_FIRST + REGION_STRIDE * region_slot[region] + REGION_CELL_OFFSET;
  real p[CELL_PARAMETERS], d[CELL_DERIVED];
  for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = P[first + k];
  cell_derive(p, dt, d);
  for (int k = 0; k < CELL_DERIVED; ++k)
    if (derived_field[k] >= 0) derived_fields[i + derived_field[k] * (size_t)stride] = d[k];
  V[i] = V_other[i] = p[REST];
  for (int k = 0; k < CELL_STATES; ++k) states[i + k * (size_t)stride] = initial[k];
#ifdef ACTIVATION
  activation[i] = -1;
#ifdef BEATS
  activation[i + (size_t)stride] = -1;
  activation[i + 2 * (size_t)stride] = 0;
#endif
#endif
}
