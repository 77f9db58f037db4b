// Initial states and derived constants of the cell models, member by member and, where a parameter differs between
// regions or through the wall, cell by cell. Needs segments.clh, heterogeneity.clh, the cell models with cell_setup.clh
// behind each, and
// -D PARAMETERS, DERIVED_CONSTANTS (of all models together), STATES (of the model that has most), REGIONS,
//    region_model[], region_cell_first[], region_varies[] (generated, by region: its cell model, the index of its first
//    cell parameter, whether its parameters vary through the wall);  -D HETEROGENEOUS: in some region they do;
// -D ACTIVATION: records activation times.
#if !defined(PARAMETERS) || !defined(DERIVED_CONSTANTS) || !defined(STATES) || !defined(REGIONS) || \
    !defined(EACH_CELL_MODEL)
#error "cell_setup.cl needs PARAMETERS, DERIVED_CONSTANTS, STATES, REGIONS and cell models"
#endif

// 1/ms of a region of cell model `model`, or of a cell of it.
real fastest_rate(int model, global const real *P, int first, const real *basis) {
#define RATE(k) if (model == k) return JOIN(fastest_rate_, k)(P, first, basis);
  EACH_CELL_MODEL(RATE)
  return 0;
}

// derived (members, DERIVED_CONSTANTS); rates (members) 1/ms: the largest over the member's regions.
kernel void derive_members(global const real *restrict parameters, global real *restrict derived,
                           global real *restrict rates, const real dt, const int members) {
  const int member = get_global_id(0);
  if (member >= members) return;
  global const real *P = parameters + (size_t)member * PARAMETERS;
#define DERIVE(k) JOIN(derive_member_, k)(P, derived + member * DERIVED_CONSTANTS, dt);
  EACH_CELL_MODEL(DERIVE)
  real fastest = 0;
  for (int region = 0; region < REGIONS; ++region)
    if (region_cell_first[region] >= 0)
      fastest = fmax(fastest, fastest_rate(region_model[region], P, region_cell_first[region], 0));
  rates[member] = fastest;
}

#ifdef HETEROGENEOUS
// The largest rate of the cells of each segment whose parameters vary, 1/ms; 0 where there is none.
kernel void segment_rates(global const real *restrict parameters, global const ushort *restrict member_of,
                          global const uchar *restrict tissue_region_of, global const real *restrict coordinates,
                          global real *restrict rates, const int stride) {
  const int segment = get_global_id(0);
  global const real *P = parameters + (size_t)member_of[segment] * PARAMETERS;
  real fastest = 0;
  for (int i = segment * LANES; i < (segment + 1) * LANES; ++i) {
    const int region = tissue_region_of[i];
    if (region == NO_REGION || !region_varies[region]) continue;
    real basis[BASES];
    wall_basis(coordinates[i], coordinates[i + (size_t)stride], coordinates[i + 2 * (size_t)stride], P, basis);
    fastest = fmax(fastest, fastest_rate(region_model[region], P, region_cell_first[region], basis));
  }
  rates[segment] = fastest;
}
#endif

// derived_fields (fields, stride), V (stride), states (STATES, stride), activation (stride), model_of (stride; with
// several models only, NO_REGION without tissue).
kernel void initialise_cells(global const real *restrict parameters, global const ushort *restrict member_of,
                             global const uchar *restrict tissue_region_of, global const real *restrict coordinates,
                             global real *restrict derived_fields, global real *restrict V,
                             global real *restrict V_other, global real *restrict states,
                             global float *restrict activation, global uchar *restrict model_of, const int stride,
                             const real dt) {
  const int i = get_global_id(0);
  global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
  const int region = tissue_region_of[i], model = region == NO_REGION ? 0 : region_model[region];
  const real *basis = 0;
#ifdef HETEROGENEOUS
  real own_basis[BASES];
  if (region != NO_REGION && region_varies[region]) {
    wall_basis(coordinates[i], coordinates[i + (size_t)stride], coordinates[i + 2 * (size_t)stride], P, own_basis);
    basis = own_basis;
  }
#endif
  real rest = 0;
  for (int k = 0; k < STATES; ++k) states[i + k * (size_t)stride] = 0;
#define SET_UP(k)                                                                                            \
  {                                                                                                          \
    const int first = model != k || region == NO_REGION ? JOIN(cell_first_, k) : region_cell_first[region]; \
    JOIN(derive_cell_, k)(P, first, model == k ? basis : 0, derived_fields, i, stride, dt);                  \
    if (model == k) rest = JOIN(initialise_, k)(P, first, basis, states, i, stride);                         \
  }
  EACH_CELL_MODEL(SET_UP)
  V[i] = V_other[i] = rest;
#ifdef ACTIVATION
  activation[i] = -1;
#ifdef BEATS
  activation[i + (size_t)stride] = -1;
  activation[i + 2 * (size_t)stride] = 0;
#endif
#endif
#if CELL_MODELS > 1
  model_of[i] = region == NO_REGION ? NO_REGION : model;
#endif
}
