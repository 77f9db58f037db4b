// Place of each cell between the columns of its region's table (templates.cl): where its value of the varying parameter
// lies in the range that the columns span. Needs segments.clh, heterogeneity.clh, the cell models with template_columns.clh
// behind each, and -D PARAMETERS, REGIONS, HETEROGENEOUS, region_model[], region_cell_first[], region_varies[].
#if !defined(PARAMETERS) || !defined(REGIONS) || !defined(EACH_CELL_MODEL)
#error "template_columns.cl needs PARAMETERS, REGIONS and cell models"
#endif

// range (members, REGIONS, 2): the parameter at the first and the last column; column (stride): 0 to 1.
kernel void template_columns(global const real *restrict parameters, global const ushort *restrict member_of,
                             global const uchar *restrict tissue_region_of, global const real *restrict coordinates,
                             global const real *restrict range, global real *restrict column, const int stride) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  column[i] = 0;
  if (region == NO_REGION || !region_varies[region]) return;
  const int member = member_of[i / LANES];
  global const real *P = parameters + (size_t)member * PARAMETERS, *ends = range + 2 * (member * REGIONS + region);
  real basis[BASES], value = 0;
  wall_basis(coordinates[i], coordinates[i + (size_t)stride], coordinates[i + 2 * (size_t)stride], P, basis);
#define VALUE(k) if (region_model[region] == k) value = JOIN(varying_, k)(P, region_cell_first[region], basis);
  EACH_CELL_MODEL(VALUE)
  column[i] = ends[1] > ends[0] ? clamp((value - ends[0]) / (ends[1] - ends[0]), R(0.0), R(1.0)) : 0;
}
