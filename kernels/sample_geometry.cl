// Evaluates geometry for tests and pictures: a signed distance at given points, or all functions of a geometry
// on a grid. Needs common.clh, signed_distance.clh, and one of
// -D DISTANCE(p)   expression of a real3 p: gives sample_distance
// -D CELLS         with the files of a geometry in front: gives sample_cells
#if !defined(DISTANCE) && !defined(CELLS)
#error "sample_geometry.cl needs DISTANCE(p), or a geometry and CELLS"
#endif

#ifdef DISTANCE
/// points (n, 4) mm; distance (n).
kernel void sample_distance(global const real4 *points, global real *distance) {
  const size_t i = get_global_id(0);
  const real3 p = points[i].xyz;
  distance[i] = DISTANCE(p);
}
#else
/// n: cells along x and y. Fields (z, y, x): region (-1 none), fraction; fibre and coordinates (z, y, x, 4),
/// zero without tissue; cavity, its fraction.
kernel void sample_cells(global const real *P, const real4 origin_and_spacing, const int2 n,
                         global int *region, global real *fraction, global real4 *fibre,
                         global real4 *coordinates, global int *cavity, global real *cavity_fraction) {
  const size_t i = get_global_id(0);
  const real h = origin_and_spacing.w;
  const real3 cell = (real3)((real)(i % n.x), (real)(i / n.x % n.y), (real)(i / (n.x * n.y)));
  const real3 p = origin_and_spacing.xyz + h * (cell + R(0.5));
  real share = R(0.0);
  const int r = tissue_region(p, h, P, &share);
  region[i] = r;
  fraction[i] = r < 0 ? R(0.0) : share;
  fibre[i] = (real4)(R(0.0));
  coordinates[i] = (real4)(R(0.0));
  if (r >= 0) {
    fibre[i].xyz = fibre_direction(p, r, P);
    coordinates[i] = tissue_coordinates(p, r, P);
  }
  cavity[i] = -1;
  cavity_fraction[i] = R(0.0);
#ifdef PARAM_geometry_heart_scale
  real blood = R(0.0);
  const int chamber = cavity_region(p, h, P, &blood);
  cavity[i] = chamber;
  cavity_fraction[i] = blood;
#endif
}
#endif
