// Fibres of a label map at the points of stress. Needs common.clh, fibres.clh, label_fibres.clh, solid_tile.clh; -D SHEETS for wall normals too.
#ifdef SHEETS
#define DIRECTION_VECTORS 8
#else
#define DIRECTION_VECTORS 4
#endif

// place (stride): of a cell in `table`, -1 where there is none. table (cells, 4 points): normal of the wall, or axis, and the
// transmural coordinate. member_of: by block of SOLID_BLOCK cells. direction: as solid_fibres in solid_setup.cl.
kernel void solid_label_fibres(global const real *restrict parameters, global const ushort *restrict member_of,
                               global const int *restrict place, global const uchar *restrict region,
                               global const float4 *restrict table, global real *restrict direction) {
  const int i = get_global_id(0);
  if (place[i] < 0) return;
  global const real *P = parameters + (size_t)member_of[i / SOLID_BLOCK] * PARAMETERS;
  const int rule = label_fibre_rule[region[i]];
  for (int g = 0; g < 4; ++g) {
    const float4 d = table[4 * place[i] + g];
    const real3 v = (real3)(d.x, d.y, d.z);
    const real3 f = label_fibre(rule, v, d.w, P);
    store_in_tile(f, direction, i, g, DIRECTION_VECTORS);
#ifdef SHEETS
    const real3 s = normal_across(rule == 1 || rule == 2 ? v : (real3)(0), f);
    store_in_tile(s, direction, i, 4 + g, DIRECTION_VECTORS);
#endif
  }
}
