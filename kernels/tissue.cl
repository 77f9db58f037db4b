// From a geometry to the compact tissue of every member: a pass over the grid, then the compact arrays. Needs a geometry file in front (tissue_region), segments.clh, and
// -D PARAMETERS (numbers in a member's block), EXCITABLE_TABLE (initialiser: 1 where a region is excitable); COORDINATES where something reads them.
#if !defined(PARAMETERS) || !defined(EXCITABLE_TABLE)
#error "tissue.cl needs PARAMETERS and EXCITABLE_TABLE"
#endif

#ifndef LABEL_FIBRES  // of a label map the cells are given, and labels.cl has the rest
constant uchar excitable[] = EXCITABLE_TABLE;

// Pass 1. region and fraction of every cell of the grid. Fields (members, NZ, NY, NX).
kernel void classify_cells(global const real *restrict parameters, const real4 origin_and_spacing,
                           global uchar *restrict region, global float *restrict fraction) {
  const int x = get_global_id(0), y = get_global_id(1), z = get_global_id(2) % NZ;
  const int member = get_global_id(2) / NZ;
  const real h = origin_and_spacing.w;
  const real3 p = origin_and_spacing.xyz + h * ((real3)((real)x, (real)y, (real)z) + R(0.5));
  real share = 0;
  const int r = tissue_region(p, h, parameters + (size_t)member * PARAMETERS, &share);
  const size_t cell = x + (size_t)NX * (y + (size_t)NY * get_global_id(2));
  const bool active = r >= 0 && excitable[r >= 0 ? r : 0] && share > 0;
  region[cell] = active ? (uchar)r : (uchar)NO_REGION;
  fraction[cell] = active ? (float)share : 0.0f;
}
#endif

// Whether each run of 8 cells along x holds tissue: (members, NZ, NY, NX / 8).
kernel void flag_segments(global const uchar *restrict region, global uchar *restrict flag) {
  const size_t segment = get_global_id(0);
  const uchar8 r = vload8(segment, region);
  flag[segment] = any(r != (uchar8)NO_REGION) ? 1 : 0;
}

// Compact copies of region and fraction, and 1 / fraction (0 where there is no tissue).
// first_cell[s]: grid cell of segment s, counted over members; -1 in padding.
kernel void gather_cells(global const uchar *restrict region, global const float *restrict fraction,
                         global const int *restrict first_cell, global uchar *restrict tissue_region_of,
                         global real *restrict capacity, global real *restrict inverse_capacity) {
  const int i = get_global_id(0), lane = i % LANES;
  const int cell = first_cell[i / LANES];
  const float share = cell < 0 ? 0.0f : fraction[cell + lane];
  tissue_region_of[i] = cell < 0 ? (uchar)NO_REGION : region[cell + lane];
  capacity[i] = share;
  inverse_capacity[i] = share > 0 ? 1 / (real)share : 0;
}

// Compact places of the eight neighbouring rows. place[]: segment number of each run of the grid, 1 (void) where it
// holds no tissue. A member whose tissue touches the grid's outermost cells is rejected, but must not lead out of the array.
kernel void link_segments(global const int *restrict first_cell, global const int *restrict place,
                          global int8 *restrict neighbours, const int grid_cells) {
  const int s = get_global_id(0);
  const int cell = first_cell[s];
  int8 n = (int8)VOID_CELL;
  if (cell >= 0) {
    const int run = cell / LANES, row = NX / LANES, layer = NX / LANES * NY;
    const int last = grid_cells / LANES - 1;
#define PLACE(offset) place[clamp(run + (offset), 0, last)]
    n = LANES * (int8)(PLACE(-row), PLACE(row), PLACE(-layer), PLACE(layer), PLACE(-row - layer), PLACE(row - layer),
                       PLACE(layer - row), PLACE(layer + row));
  }
  neighbours[s] = n;
}

#ifndef LABEL_FIBRES
// Centre of the compact cell i.
static inline real3 compact_centre(global const int *restrict first_cell, int i, real4 origin_and_spacing) {
  return cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz, origin_and_spacing.w);
}

// Fibre directions at the centres of tissue cells: (3, stride). Zero where the rule gives none.
kernel void fibre_field(global const real *restrict parameters, const real4 origin_and_spacing,
                        global const int *restrict first_cell, global const ushort *restrict member_of,
                        global const uchar *restrict tissue_region_of, global real *restrict fibre, const int stride) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  real3 f = (real3)(0);
  if (region != NO_REGION)
    f = fibre_direction(compact_centre(first_cell, i, origin_and_spacing), region,
                        parameters + (size_t)member_of[i / LANES] * PARAMETERS);
  fibre[i] = f.x;
  fibre[i + (size_t)stride] = f.y;
  fibre[i + 2 * (size_t)stride] = f.z;
}

#ifdef COORDINATES
// tissue_coordinates at the centres of tissue cells: (4, stride). Zero elsewhere.
kernel void coordinate_field(global const real *restrict parameters, const real4 origin_and_spacing,
                             global const int *restrict first_cell, global const ushort *restrict member_of,
                             global const uchar *restrict tissue_region_of, global real *restrict coordinates,
                             const int stride) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  real4 c = (real4)(0);
  if (region != NO_REGION)
    c = tissue_coordinates(compact_centre(first_cell, i, origin_and_spacing), region,
                           parameters + (size_t)member_of[i / LANES] * PARAMETERS);
  coordinates[i] = c.x;
  coordinates[i + (size_t)stride] = c.y;
  coordinates[i + 2 * (size_t)stride] = c.z;
  coordinates[i + 3 * (size_t)stride] = c.w;
}
#endif
#endif
