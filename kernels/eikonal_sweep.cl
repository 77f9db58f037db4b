// Sweeps of arrival times, with -D SHEET of those in a sheet too: a program of its own, as a scene has one or the other.
// Needs segments.clh, eikonal.clh, -D WIDTH.

// ---- The local solver ----

// The triangle a, b, c; M in the tetrahedron's signed axes.
inline realv triangle(realv best, realv Ta, realv Tb, realv Tc, realv M11, realv inverse_M11, realv M12, realv M13, realv M22,
                      realv M23, realv M33) {
  const realv q2 = Ta - Tb, q3 = Tb - Tc;
  const realv v2 = fma(M22, q2, M23 * q3), v3 = fma(M23, q2, M33 * q3);
  const realv v1 = fma(M12, q2, M13 * q3);
  const realv rest = fma(q2, v2, fma(q3, v3, (realv)(-1)));
  const realv square = fma(v1, v1, -M11 * rest);
  const realv w1 = sqrt(fmax(square, (realv)(0)));
  const realv q1 = (w1 - v1) * inverse_M11;
  const realv w2 = fma(M12, q1, v2), w3 = fma(M13, q1, v3);
  const intv inside = isgreater(square, (realv)(0)) & isgreaterequal(w1, w2) & isgreaterequal(w2, w3) &
                      isgreaterequal(w3, (realv)(0)) & isgreater(q1, (realv)(0));
  return WHERE(inside, fmin(best, Ta + q1), best);
}

// The edge from a to b: A = |a|^2, B = a.d, C = |d|^2 with d = b - a, in the metric; inverse_C = 1 / C.
inline realv edge(realv best, realv Ta, realv Tb, realv A, realv B, realv C, realv inverse_C) {
  const realv rise = Tb - Ta;
  const realv E = fma(-rise, rise, C);
  const realv root = sqrt(fmax(fma(A, C, -B * B) * E, (realv)(0)));
  const realv place = -fma(B, E, rise * root);  // E C times the share of b
  const intv inside = isgreater(E, (realv)(0)) & isgreaterequal(place, (realv)(0)) & islessequal(place, E * C);
  return WHERE(inside, fmin(best, Ta + (root - rise * B) * inverse_C), best);
}

#define OX 1
#define OY 3
#define OZ 9
#define AT(offset) t[CENTRE + (offset)]
// Triangles whose a lies along axis 1, b along 1 and 2.
#define TRIANGLE(o1, o2, o3, s1, s2, s3, M11, I11, M12, M13, M22, M23, M33)                                          \
  best = triangle(best, AT(s1 * o1), AT(s1 * o1 + s2 * o2), AT(s1 * o1 + s2 * o2 + s3 * o3), M11, I11, s1 * s2 * M12, \
                  s1 * s3 * M13, M22, s2 * s3 * M23, M33);
#define TRIANGLES(o1, o2, o3, M11, I11, M12, M13, M22, M23, M33)            \
  TRIANGLE(o1, o2, o3, 1, 1, 1, M11, I11, M12, M13, M22, M23, M33)          \
  TRIANGLE(o1, o2, o3, 1, 1, -1, M11, I11, M12, M13, M22, M23, M33)         \
  TRIANGLE(o1, o2, o3, 1, -1, 1, M11, I11, M12, M13, M22, M23, M33)         \
  TRIANGLE(o1, o2, o3, 1, -1, -1, M11, I11, M12, M13, M22, M23, M33)        \
  TRIANGLE(o1, o2, o3, -1, 1, 1, M11, I11, M12, M13, M22, M23, M33)         \
  TRIANGLE(o1, o2, o3, -1, 1, -1, M11, I11, M12, M13, M22, M23, M33)        \
  TRIANGLE(o1, o2, o3, -1, -1, 1, M11, I11, M12, M13, M22, M23, M33)        \
  TRIANGLE(o1, o2, o3, -1, -1, -1, M11, I11, M12, M13, M22, M23, M33)
// Edges in the plane of axes 1 and 2, from a on axis 1 along axis 2.
#define EDGES_AB(o1, o2, G11, G12, G22, I22)                                       \
  best = edge(best, AT(o1), AT(o1 + o2), G11, G12, G22, I22);                      \
  best = edge(best, AT(o1), AT(o1 - o2), G11, -G12, G22, I22);                     \
  best = edge(best, AT(-o1), AT(-o1 + o2), G11, -G12, G22, I22);                   \
  best = edge(best, AT(-o1), AT(-o1 - o2), G11, G12, G22, I22);
// From the edge neighbour s1 e1 + s2 e2, of squared length N, along axis 3; and from s1 e1 along the diagonal s2 e2 + s3 e3,
// of squared length N.
#define EDGES_BC(o1, o2, o3, s1, s2, N, G13, G23, G33, I33)                                                            \
  best = edge(best, AT(s1 * o1 + s2 * o2), AT(s1 * o1 + s2 * o2 + o3), N, s1 * G13 + s2 * G23, G33, I33);              \
  best = edge(best, AT(s1 * o1 + s2 * o2), AT(s1 * o1 + s2 * o2 - o3), N, -(s1 * G13 + s2 * G23), G33, I33);
#define EDGES_AC(o1, o2, o3, s2, s3, N, IN, G11, G12, G13)                                                             \
  best = edge(best, AT(o1), AT(o1 + s2 * o2 + s3 * o3), G11, s2 * G12 + s3 * G13, N, IN);                              \
  best = edge(best, AT(-o1), AT(-o1 + s2 * o2 + s3 * o3), G11, -(s2 * G12 + s3 * G13), N, IN);
// Edges that touch the diagonals e1 +- e2, of squared lengths P (+) and Q (-); axis 3 is the other one.
#define DIAGONALS(o1, o2, o3, P, Q, G13, G23, G33, I33) \
  {                                                     \
    const realv IP = 1 / P, IQ = 1 / Q;                 \
    EDGES_BC(o1, o2, o3, 1, 1, P, G13, G23, G33, I33)   \
    EDGES_BC(o1, o2, o3, -1, -1, P, G13, G23, G33, I33) \
    EDGES_BC(o1, o2, o3, 1, -1, Q, G13, G23, G33, I33)  \
    EDGES_BC(o1, o2, o3, -1, 1, Q, G13, G23, G33, I33)  \
    EDGES_AC(o3, o1, o2, 1, 1, P, IP, G33, G13, G23)    \
    EDGES_AC(o3, o1, o2, -1, -1, P, IP, G33, G13, G23)  \
    EDGES_AC(o3, o1, o2, 1, -1, Q, IQ, G33, G13, G23)   \
    EDGES_AC(o3, o1, o2, -1, 1, Q, IQ, G33, G13, G23)   \
  }
// Both neighbours at +-offset, of squared length N.
#define VERTICES(offset, N) best = fmin(best, fmin(AT(offset), AT(-(offset))) + sqrt(N));

// T_0 from the neighbours' times t[27] in the metric G.
inline realv arrival(const realv *t, realv best, realv xx, realv yy, realv zz, realv xy, realv xz, realv yz) {
  const realv xy_p = xx + yy + 2 * xy, xy_m = xx + yy - 2 * xy, xz_p = xx + zz + 2 * xz, xz_m = xx + zz - 2 * xz;
  const realv yz_p = yy + zz + 2 * yz, yz_m = yy + zz - 2 * yz;
  VERTICES(OX, xx)
  VERTICES(OY, yy)
  VERTICES(OZ, zz)
  VERTICES(OX + OY, xy_p)
  VERTICES(OX - OY, xy_m)
  VERTICES(OX + OZ, xz_p)
  VERTICES(OX - OZ, xz_m)
  VERTICES(OY + OZ, yz_p)
  VERTICES(OY - OZ, yz_m)
  VERTICES(OX + OY + OZ, xy_p + zz + 2 * (xz + yz))
  VERTICES(OX + OY - OZ, xy_p + zz - 2 * (xz + yz))
  VERTICES(OX - OY + OZ, xy_m + zz + 2 * (xz - yz))
  VERTICES(OX - OY - OZ, xy_m + zz - 2 * (xz - yz))
  const realv ix = 1 / xx, iy = 1 / yy, iz = 1 / zz;
  EDGES_AB(OX, OY, xx, xy, yy, iy)
  EDGES_AB(OY, OX, yy, xy, xx, ix)
  EDGES_AB(OX, OZ, xx, xz, zz, iz)
  EDGES_AB(OZ, OX, zz, xz, xx, ix)
  EDGES_AB(OY, OZ, yy, yz, zz, iz)
  EDGES_AB(OZ, OY, zz, yz, yy, iy)
  DIAGONALS(OX, OY, OZ, xy_p, xy_m, xz, yz, zz, iz)
  DIAGONALS(OX, OZ, OY, xz_p, xz_m, xy, yz, yy, iy)
  DIAGONALS(OY, OZ, OX, yz_p, yz_m, xy, xz, xx, ix)
  // M = G^-1 by cofactors.
  const realv cxx = fma(yy, zz, -yz * yz), cyy = fma(xx, zz, -xz * xz), czz = fma(xx, yy, -xy * xy);
  const realv cxy = fma(xz, yz, -xy * zz), cxz = fma(xy, yz, -xz * yy), cyz = fma(xy, xz, -yz * xx);
  const realv scale = 1 / fma(xx, cxx, fma(xy, cxy, xz * cxz));
  const realv Mxx = scale * cxx, Myy = scale * cyy, Mzz = scale * czz;
  const realv Mxy = scale * cxy, Mxz = scale * cxz, Myz = scale * cyz;
  const realv Ixx = 1 / Mxx, Iyy = 1 / Myy, Izz = 1 / Mzz;
  TRIANGLES(OX, OY, OZ, Mxx, Ixx, Mxy, Mxz, Myy, Myz, Mzz)
  TRIANGLES(OX, OZ, OY, Mxx, Ixx, Mxz, Mxy, Mzz, Myz, Myy)
  TRIANGLES(OY, OX, OZ, Myy, Iyy, Mxy, Myz, Mxx, Mxz, Mzz)
  TRIANGLES(OY, OZ, OX, Myy, Iyy, Myz, Mxy, Mzz, Mxz, Mxx)
  TRIANGLES(OZ, OX, OY, Mzz, Izz, Mxz, Myz, Mxx, Mxy, Myy)
  TRIANGLES(OZ, OY, OX, Mzz, Izz, Myz, Mxz, Myy, Mxy, Mxx)
  return best;
}

// ---- A sweep ----

#if WIDTH == 1
#define LOAD_LINKS(p) (*(p))
typedef int linkv;
#else
#define LOAD_LINKS(p) JOIN(vload, WIDTH)(0, (p))
typedef JOIN(int, WIDTH) linkv;
#endif
#ifdef DOUBLE
#if WIDTH == 1
#define LINKED(links, k) ((links) >> (k) & 1)
#else
#define LINKED(links, k) (JOIN(convert_, JOIN(long, WIDTH))((links) << (31 - (k))) < 0L)
#endif
#else
#if WIDTH == 1
#define LINKED(links, k) ((links) >> (k) & 1)
#else
#define LINKED(links, k) (((links) << (31 - (k))) < 0)
#endif
#endif
#define NEIGHBOUR(dx, dy, dz, row)                                                                  \
  {                                                                                                 \
    const int k = CENTRE + (dx) + OY * (dy) + OZ * (dz);                                            \
    t[k] = WHERE(LINKED(links, k), LOAD(field + (row) + (dx)), (realv)(UNREACHED));                 \
  }
#define ROW(dy, dz, row) NEIGHBOUR(-1, dy, dz, row) NEIGHBOUR(0, dy, dz, row) NEIGHBOUR(1, dy, dz, row)
#define NEIGHBOURS                                                                                  \
  ROW(-1, 0, r.ym) ROW(1, 0, r.yp) ROW(0, -1, r.zm) ROW(0, 1, r.zp) ROW(-1, -1, r.ym_zm) ROW(1, -1, r.yp_zm) \
  ROW(-1, 1, r.ym_zp) ROW(1, 1, r.yp_zp) NEIGHBOUR(-1, 0, 0, i) NEIGHBOUR(1, 0, 0, i) t[CENTRE] = UNREACHED;

// Whether the segment of cell `cell`, or one beside it in memory, changed in sweep `mark`.
inline bool row_changed(global const int *changed, int cell, int mark) {
  const int s = cell / LANES;
  return changed[s - 1] == mark || changed[s] == mark || changed[s + 1] == mark;
}

// One Jacobi sweep T -> T_new, number `sweep`: changed_before holds, by segment, the last sweep of the other parity that
// changed it. Segments that no neighbour has touched keep what they hold in both fields. last_change: the last sweep that
// changed anything.
kernel void eikonal_sweep(global const real *restrict T, global real *restrict T_new, global const real *restrict metric,
                          global const int *restrict linked, global const int *restrict in_sheet,
                          global const real *restrict sheet_metric, global const real *restrict sheet_depth,
                          global const int8 *restrict neighbours,
                          global const int *restrict changed_before, global int *restrict changed,
                          global const real *restrict correction, global int *restrict last_change, const int sweep,
                          const int stride) {
  const int i = THIS_CELL;
  const Rows r = neighbour_rows(neighbours, i);
  const int mark = sweep - 1;
  const bool active = row_changed(changed_before, i, mark) || row_changed(changed_before, r.ym, mark) ||
                      row_changed(changed_before, r.yp, mark) || row_changed(changed_before, r.zm, mark) ||
                      row_changed(changed_before, r.zp, mark) || row_changed(changed_before, r.ym_zm, mark) ||
                      row_changed(changed_before, r.yp_zm, mark) || row_changed(changed_before, r.ym_zp, mark) ||
                      row_changed(changed_before, r.yp_zp, mark);
  if (!active) return;
  const realv old = LOAD(T + i);
  realv t[27];
  linkv links = LOAD_LINKS(linked + i);
  global const real *field = T;
  NEIGHBOURS
  global const real *G = metric + i;
  realv best = arrival(t, (realv)(UNREACHED), LOAD(G), LOAD(G + (size_t)stride), LOAD(G + 2 * (size_t)stride), LOAD(G + 3 * (size_t)stride),
                       LOAD(G + 4 * (size_t)stride), LOAD(G + 5 * (size_t)stride));
  best = fmin(old, best - LOAD(correction + i));
  bool moved = false;
#ifdef SHEET
  links = LOAD_LINKS(in_sheet + i);
  if (ANY(links != 0)) {
    field = T + stride;
    NEIGHBOURS
    const realv depth = LOAD(sheet_depth + i), old_in_sheet = LOAD(field + i);
    G = sheet_metric + i;
    realv in_sheet_best = arrival(t, old_in_sheet, LOAD(G), LOAD(G + (size_t)stride), LOAD(G + 2 * (size_t)stride),
                                  LOAD(G + 3 * (size_t)stride), LOAD(G + 4 * (size_t)stride), LOAD(G + 5 * (size_t)stride));
    const intv lent = isless(depth, (realv)(0));  // the wave in the sheet comes out here, but none goes in
    in_sheet_best = fmin(in_sheet_best, WHERE(lent, (realv)(UNREACHED), best + depth));
    best = fmin(best, in_sheet_best + fabs(depth));
    const realv least = fma((realv)(ROUNDING), fabs(old_in_sheet), (realv)(ROUNDING));
    const intv earlier = isless(in_sheet_best, old_in_sheet - least);
    STORE(WHERE(earlier, in_sheet_best, old_in_sheet), T_new + stride + i);
    moved = ANY(earlier);
  }
#endif
  // Differences of a few roundings are left: they would only pass back and forth.
  const realv least = fma((realv)(ROUNDING), fabs(old), (realv)(ROUNDING));
  const intv earlier = isless(best, old - least);
  STORE(WHERE(earlier, best, old), T_new + i);
  if (moved || ANY(earlier)) {
    changed[i / LANES] = sweep;
    *last_change = sweep;
  }
}
