// What the mechanics' cells hold: shares of tissue and of each void (blood of a cavity, the outside of a named surface),
// by samples of the geometry; then fibres at the points where stress is evaluated. Needs a geometry file with solid_part()
// in front, and -D NX, NY, NZ, PARAMETERS, VOIDS (named voids), SAMPLES (along an edge of a cell; SAMPLES^3 < 256).
#if !defined(PARAMETERS) || !defined(VOIDS) || !defined(SAMPLES)
#error "solid_setup.cl needs PARAMETERS, VOIDS, SAMPLES"
#endif
#define NO_PART 255

// solid_part(p, P): the region at p (>= 0), or -1 - k in void k of the scene (solver/solid_voids.hpp), k = 0 without a name.
//
// counts (1 + VOIDS, members, NZ, NY, NX): of SAMPLES^3 samples of a cell those in tissue, then those in each named void. A
// cell with one part at its corners and centre is taken for uniform. region (members, NZ, NY, NX): of most of the samples.
kernel void solid_parts(global const real *restrict parameters, const real4 origin_and_spacing,
                        global ushort *restrict counts, global uchar *restrict region) {
  const int x = get_global_id(0), y = get_global_id(1), z = get_global_id(2) % NZ;
  const int member = get_global_id(2) / NZ;
  const size_t cell = x + (size_t)NX * (y + (size_t)NY * get_global_id(2));
  const size_t cells = (size_t)NX * NY * get_global_size(2);
  global const real *P = parameters + (size_t)member * PARAMETERS;
  const real h = origin_and_spacing.w;
  const real3 corner = origin_and_spacing.xyz + h * (real3)((real)x, (real)y, (real)z);
  int number[4 * (1 + VOIDS)], of_region[REGION_COUNT];
  for (int k = 0; k < 4 * (1 + VOIDS); ++k) number[k] = 0;
  for (int r = 0; r < REGION_COUNT; ++r) of_region[r] = 0;
  // A little inside the corners: surfaces on faces of the grid are common.
  const int centre = solid_part(corner + R(0.5) * h, P);
  bool uniform = true;
  for (int k = 0; k < 8 && uniform; ++k)
    uniform = solid_part(corner + h * (R(0.01) + R(0.98) * (real3)((real)(k & 1), (real)(k >> 1 & 1), (real)(k >> 2))),
                         P) == centre;
  const int all = SAMPLES * SAMPLES * SAMPLES;
  if (uniform) {
    const int part = centre >= 0 ? 0 : centre < -1 ? -1 - centre : -1;
    if (centre >= 0) of_region[centre] = all;
    for (int g = 0; g < 4 && part >= 0; ++g) number[4 * part + g] = 3 * all;
  } else {
    for (int k = 0; k < all; ++k) {
      const real3 at = (real3)((real)(k % SAMPLES), (real)(k / SAMPLES % SAMPLES), (real)(k / (SAMPLES * SAMPLES)));
      const int part = solid_part(corner + h / SAMPLES * (at + R(0.5)), P);
      if (part >= 0) ++of_region[part];
      const int slot = part >= 0 ? 0 : -1 - part;
      if (part == -1) continue;
      // The point it belongs to; where several are as near, a share to each.
      const real3 c = at + R(0.5) - R(0.5) * SAMPLES;
      const real along[4] = {c.x + c.y + c.z, c.x - c.y - c.z, c.y - c.x - c.z, c.z - c.x - c.y};
      real most = along[0];
      for (int g = 1; g < 4; ++g) most = fmax(most, along[g]);
      int nearest = 0;
      for (int g = 0; g < 4; ++g) nearest += along[g] > most - R(0.1);
      for (int g = 0; g < 4; ++g)
        if (along[g] > most - R(0.1)) number[4 * slot + g] += 12 / nearest;
    }
  }
  for (int k = 0; k < 4 * (1 + VOIDS); ++k) counts[cell + k * cells] = (ushort)number[k];
  int most = 0;
  for (int r = 1; r < REGION_COUNT; ++r)
    if (of_region[r] > of_region[most]) most = r;
  region[cell] = of_region[most] > 0 ? (uchar)most : (uchar)NO_PART;
}

// Bit k: void k + 1 lies within a quarter of a cell of a vertex. vertex: its place in the grid of vertices
// (NX + 1, NY + 1, NZ + 1), counted over members; -1 in padding.
kernel void solid_vertex_voids(global const real *restrict parameters, const real4 origin_and_spacing,
                               global const int *restrict vertex, global ushort *restrict near) {
  const int a = get_global_id(0), v = vertex[a];
  ushort found = 0;
  if (v >= 0) {
    const int x = v % (NX + 1), y = v / (NX + 1) % (NY + 1), zm = v / ((NX + 1) * (NY + 1));
    const real h = origin_and_spacing.w;
    const real3 p = origin_and_spacing.xyz + h * (real3)((real)x, (real)y, (real)(zm % (NZ + 1)));
    for (int k = 0; k < 8; ++k) {
      const real3 offset = (real3)((real)(k & 1), (real)(k >> 1 & 1), (real)(k >> 2)) - R(0.5);
      const int part = solid_part(p + R(0.5) * h * offset, parameters + (size_t)(zm / (NZ + 1)) * PARAMETERS);
      if (part < -1) found |= 1 << (-2 - part);
    }
  }
  near[a] = found;
}

// Unit fibre directions, and with -D SHEETS wall normals, at the four points of each cell: by tiles (1 or 2, points, 3).
#ifdef SHEETS
#define DIRECTION_VECTORS 8
#else
#define DIRECTION_VECTORS 4
#endif
kernel void solid_fibres(global const real *restrict parameters, const real4 origin_and_spacing,
                         global const int *restrict grid_cell, global const uchar *restrict region,
                         global real *restrict direction) {
  const int i = get_global_id(0), cell = grid_cell[i];
  if (cell < 0) return;
  const int x = cell % NX, y = cell / NX % NY, zm = cell / (NX * NY);
  global const real *P = parameters + (size_t)(zm / NZ) * PARAMETERS;
  const real h = origin_and_spacing.w;
  const real3 centre = origin_and_spacing.xyz + h * ((real3)((real)x, (real)y, (real)(zm % NZ)) + R(0.5));
  for (int g = 0; g < 4; ++g) {
    const real3 sign = (real3)(g < 2 ? R(1.0) : R(-1.0), g % 2 == 0 ? R(1.0) : R(-1.0), g == 0 || g == 3 ? R(1.0) : R(-1.0));
    const real3 p = centre + R(0.28867513459481287) * h * sign;
    const real3 f = fibre_direction(p, region[i], P);
    store_in_tile(f, direction, i, g, DIRECTION_VECTORS);
#ifdef SHEETS
    const real3 s = wall_normal(p, region[i], P);
    store_in_tile(s, direction, i, 4 + g, DIRECTION_VECTORS);
#endif
  }
}
