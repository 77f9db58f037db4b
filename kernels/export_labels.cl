// Labels of a computed geometry on a grid, for export. Needs common.clh and the files of a geometry.
// -D CAVITIES   the geometry defines cavity_region

// What fills most of each cell: 0 nothing, 1 + r region r, 128 + c cavity c. label (z, y, x); n: cells along x and y.
kernel void export_labels(global const real *P, const real4 origin_and_spacing, const int2 n,
                          global uchar *restrict label) {
  const size_t i = get_global_id(0);
  const real h = origin_and_spacing.w;
  const real3 cell = (real3)((real)(i % n.x), (real)(i / n.x % n.y), (real)(i / ((size_t)n.x * n.y)));
  const real3 p = origin_and_spacing.xyz + h * (cell + R(0.5));
  real tissue = R(0.0), blood = R(0.0);
  const int region = tissue_region(p, h, P, &tissue);
  int cavity = -1;
  if (region < 0) tissue = R(0.0);
#ifdef CAVITIES
  if (tissue < R(1.0)) cavity = cavity_region(p, h, P, &blood);
#endif
  const real empty = R(1.0) - tissue - blood;
  uchar result = 0;
  if (region >= 0 && tissue >= blood && tissue >= empty) result = (uchar)(1 + region);
  if (cavity >= 0 && blood > tissue && blood >= empty) result = (uchar)(128 + cavity);
  label[i] = result;
}
