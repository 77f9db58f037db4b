// Fibres and coordinates of label hearts: tables of one member, read by all, since labels are the same for each.
// Needs common.clh, fibres.clh, segments.clh, label_fibres.clh.

// Place in member 0's compact fields of the cell at place i.
int first_member_place(int i, global const int *restrict first_cell, global const int *restrict place) {
  const int run = first_cell[i / LANES] % (NX * NY * NZ) / LANES;
  return place[run] * LANES + i % LANES;
}

// direction: of member 0's compact cells, (x, y, z, u). fibre: (3, stride).
kernel void label_fibres(global const real *restrict parameters, global const int *restrict first_cell,
                         global const int *restrict place, global const ushort *restrict member_of,
                         global const uchar *restrict tissue_region_of, global const float4 *restrict direction,
                         global real *restrict fibre, const int stride) {
  const int i = get_global_id(0);
  const int region = tissue_region_of[i];
  real3 f = (real3)(0);
  if (region != NO_REGION) {
    const float4 d = direction[first_member_place(i, first_cell, place)];
    const real3 v = (real3)(d.x, d.y, d.z);
    global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
    f = label_fibre(label_fibre_rule[region], v, d.w, P);
  }
  fibre[i] = f.x;
  fibre[i + (size_t)stride] = f.y;
  fibre[i + 2 * (size_t)stride] = f.z;
}

// table: of member 0's compact cells. coordinates: (4, stride).
kernel void label_coordinates(global const int *restrict first_cell, global const int *restrict place,
                              global const uchar *restrict tissue_region_of,
                              global const float4 *restrict table, global real *restrict coordinates,
                              const int stride) {
  const int i = get_global_id(0);
  const float4 c = tissue_region_of[i] == NO_REGION ? (float4)(0) : table[first_member_place(i, first_cell, place)];
  coordinates[i] = c.x;
  coordinates[i + (size_t)stride] = c.y;
  coordinates[i + 2 * (size_t)stride] = c.z;
  coordinates[i + 3 * (size_t)stride] = c.w;
}
