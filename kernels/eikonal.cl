// Arrival times T of an activation front on the compact tissue: sqrt(grad T . M grad T) = 1 with the squared velocity
// M = v_l^2 f f^T + v_t^2 (I - f f^T) (Colli Franzone & Guerri, Math. Biosci. 113 (1993) 145, eq. 2.18 without curvature).
//
// The local solver is Hopf's and Lax's formula on the 26 neighbours x_k (Bornemann & Rasch, Comput. Vis. Sci. 9 (2006) 57):
//     T_0 = min over the surface of their cube of  T(y) + |x_0 - y|_G,   G = M^-1,
// T linear on each of the surface's 48 triangles (face, edge and corner neighbour): 26 vertices, 72 edges, 48 triangles,
// each in closed form. It is monotone, so the iteration T <- min(T, T_0) from above converges to one solution for any
// anisotropy, in Jacobi sweeps over the segments of which a neighbour has changed (Jeong & Whitaker, SIAM J. Sci. Comput.
// 30 (2008) 2512). What a sweep does depends on the member alone, and a member that has converged does not change any more:
// its result is the same to the bit in every batch.
//
// In a tetrahedron x_0, a = x_0 + s1 e1, b = a + s2 e2, c = b + s3 e3 two components of grad T are differences of the known
// values, q2 = T_a - T_b, q3 = T_b - T_c, and the eikonal equation is a quadratic for the third, T_0 = T_a + q1; it
// holds if the characteristic w = M q comes from inside, w1 >= w2 >= w3 >= 0 (axes signed by s, M over dx^2).
//
// On its own this is first order, and late: linear interpolation lies above a front that spreads. A second solution corrects
// it: from the first one's second differences H, at the foot y = sum lambda_k x_k of the characteristic,
//     T(y) = sum_k lambda_k T_k - 1/2 sum_{k<l} lambda_k lambda_l (x_k - x_l) . H (x_k - x_l) + O(dx^3),
// with the smaller H of both ends (none where their signs differ, as where fronts meet), none in a sheet.
//
// A sheet is a surface that conducts at an isotropic speed of its own (a Purkinje layer), known by the cells about it, which
// hold a second time S: when the wave in the sheet passes beside them. S obeys the same local solver between cells of one
// sheet alone, with all corners of a triangle in it, else the wave would jump a thin wall. Wave and sheet excite each other
// after the way between them: T <= S + depth, S <= T + depth. So it matters little how many cells the set has and which lie
// in it, as long as it has no holes: at least about dx thick. A sheet's rim lies between cells: those beyond it hold S as if the
// sheet went on, and T <= S + |depth| with a negative depth that tells it, the way from the rim less S's from there.
//
// Needs segments.clh, field_gradient.clh. Fields are (stride), T with a sheet (2, stride): T, S; speed (2, stride) along and across fibres, mm/ms;
// times ms, UNREACHED where the wave has not come. Bit k = (dx+1) + 3 (dy+1) + 9 (dz+1) of `linked` (`in_sheet`): neighbour (dx, dy, dz) is tissue of
// the same graph (of the same sheet).

#define UNREACHED R(1e9)
#ifdef DOUBLE
#define ROUNDING 5e-16
#else
#define ROUNDING 2.5e-7f  // two units in the last place
#endif
#define CENTRE 13
#define GAP R(0.25)  // in dx, twice what may pass as touching: near its edge a groove has no cells between its faces

// Normals of sheets, (3, stride): the gradient of the distance (stride), mm.
kernel void eikonal_normals(global const int *restrict first_cell, global const int *restrict place,
                            global const uchar *restrict region, global const uchar *restrict sheet,
                            global const real *restrict distance, global real *restrict normal, const real dx,
                            const int stride, const int grid_cells) {
  const int i = get_global_id(0);
  const real3 n = sheet[i] != 0 ? distance_gradient(distance, i, first_cell, place, region, dx, grid_cells) : (real3)(0);
  normal[i] = n.x;
  normal[i + (size_t)stride] = n.y;
  normal[i + 2 * (size_t)stride] = n.z;
}

// Neighbours of every cell. graph_of_region: a bit for each graph of a region, a wave passes between cells that share one.
// In a sheet it does not pass between cells whose normals turn by more than a right angle with blood between them: they lie on two
// faces of a groove, and the way leads round its edge. Halfway between them the distance is (m of both faces)
//     2 m = d_i + d_j + (n_i - n_j).(x_j - x_i) / 2.
kernel void eikonal_link(global const int *restrict first_cell, global const int *restrict place,
                         global const uchar *restrict region, global const uchar *restrict graph_of_region,
                         global const uchar *restrict sheet, const int with_sheet, global const real *restrict distance,
                         global const real *restrict normal, global int *restrict linked, global int *restrict in_sheet,
                         const real dx, const int stride, const int grid_cells) {
  const int i = get_global_id(0);
  const int own = region[i];
  int links = 0, same_sheet = 0;
  if (own != NO_REGION) {
    const int cell = first_cell[i / LANES] + i % LANES, graph = graph_of_region[own];
    const int own_sheet = with_sheet ? sheet[i] : 0;
    for (int k = 0; k < 27; ++k) {
      const int n = clamp(cell + k % 3 - 1 + NX * (k / 3 % 3 - 1 + NY * (k / 9 - 1)), 0, grid_cells - 1);
      const int j = LANES * place[n / LANES] + n % LANES, r = region[j];
      if (k == CENTRE || r == NO_REGION || (graph_of_region[r] & graph) == 0) continue;
      links |= 1 << k;
      if (own_sheet == 0 || sheet[j] != own_sheet) continue;
      const int way[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      real turn = 0, halfway = distance[i] + distance[j];
      for (int a = 0; a < 3; ++a) {
        const real n_i = normal[i + a * (size_t)stride], n_j = normal[j + a * (size_t)stride];
        turn += n_i * n_j;
        halfway += R(0.5) * dx * (n_i - n_j) * (real)way[a];
      }
      if (turn >= 0 || halfway > -GAP * dx) same_sheet |= 1 << k;
    }
  }
  linked[i] = links;
  if (with_sheet) in_sheet[i] = same_sheet;
}

// Metric of a sheet, (6, stride), ms^2: steps along the surface count in full, steps across it a quarter,
// G = dx^2 (I - n n^T + n n^T / 16) / v^2, so that a set of cells that follows an inclined surface in stairs conducts at v.
kernel void eikonal_sheet_metric(global const real *restrict normal, global const real *restrict speed,
                                 global real *restrict metric, const real dx, const int stride) {
  const int i = get_global_id(0);
  const real n[3] = {normal[i], normal[i + (size_t)stride], normal[i + 2 * (size_t)stride]};
  // Shorter than 1 where a neighbour is missing: then as much less.
  const real length2 = fmax(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], R(1.0)), full = dx * dx / (speed[i] * speed[i]);
  const real less = full * (R(1.0) / 16 - 1) / length2;
  for (int a = 0; a < 3; ++a) metric[i + a * (size_t)stride] = full + less * n[a] * n[a];
  metric[i + 3 * (size_t)stride] = less * n[0] * n[1];
  metric[i + 4 * (size_t)stride] = less * n[0] * n[2];
  metric[i + 5 * (size_t)stride] = less * n[1] * n[2];
}

// Metric G dx^2 of each cell, (6, stride) xx yy zz xy xz yz, ms^2; where a speed is not positive the cell conducts nothing.
kernel void eikonal_metric(global const real *restrict fibre, global const real *restrict speed,
                           global const uchar *restrict region, global real *restrict metric, global int *restrict linked,
                           const real dx, const int stride) {
  const int i = get_global_id(0);
  const real along = speed[i], across = speed[i + (size_t)stride];
  const bool conducts = region[i] != NO_REGION && along > 0 && across > 0;
  if (!conducts) linked[i] = 0;
  const real slow = conducts ? dx * dx / (across * across) : 1, less = conducts ? dx * dx / (along * along) - slow : 0;
  const real f[3] = {fibre[i], fibre[i + (size_t)stride], fibre[i + 2 * (size_t)stride]};
  for (int a = 0; a < 3; ++a) metric[i + a * (size_t)stride] = slow + less * f[a] * f[a];
  metric[i + 3 * (size_t)stride] = less * f[0] * f[1];
  metric[i + 4 * (size_t)stride] = less * f[0] * f[2];
  metric[i + 5 * (size_t)stride] = less * f[1] * f[2];
}

// The metric, and the way between cells and sheet, for sqrt(grad T . M grad T) = slowness.
kernel void eikonal_slow(global const real *restrict slowness, global real *restrict metric, global const real *restrict depth,
                         global real *restrict slowed_depth, const int with_sheet, const int stride) {
  const int i = get_global_id(0);
  const real slow = slowness[i] > 0 ? slowness[i] : 1;
  for (int c = 0; c < 6; ++c) metric[i + c * (size_t)stride] *= slow * slow;
  if (with_sheet) slowed_depth[i] = slow * depth[i];
}

// T from an initial field (finite and below UNREACHED where the wave starts; nowhere without `with_initial`), and the
// segments that start it.
kernel void eikonal_start(global const real *restrict initial, const int with_initial, global const uchar *restrict region,
                          global real *restrict T, global real *restrict T_other, const int with_sheet,
                          global int *restrict changed, const int mark, const int stride) {
  const int i = get_global_id(0);
  const real start = with_initial && region[i] != NO_REGION ? initial[i] : UNREACHED;
  const real t = start < UNREACHED ? start : UNREACHED;  // of NaN: UNREACHED
  T[i] = T_other[i] = t;
  if (with_sheet) T[i + (size_t)stride] = T_other[i + (size_t)stride] = UNREACHED;
  if (t < UNREACHED) changed[i / LANES] = mark;
}

// Second differences of T by cell, (6, stride) xx yy zz xy xz yz; UNREACHED where a neighbour is missing.
kernel void eikonal_second_differences(global const int *restrict first_cell, global const int *restrict place,
                                       global const real *restrict T, global const int *restrict linked,
                                       global real *restrict second, const int stride, const int grid_cells) {
  const int i = get_global_id(0);
  real t[27];
  const int links = linked[i];
  if (!(T[i] < UNREACHED)) return;
  const int cell = first_cell[i / LANES] + i % LANES;
  for (int k = 0; k < 27; ++k)
    t[k] = links >> k & 1
               ? T[neighbour_place(place, cell, k % 3 - 1 + NX * (k / 3 % 3 - 1 + NY * (k / 9 - 1)), grid_cells)]
               : UNREACHED;
  const int axis[3] = {1, 3, 9};
  for (int a = 0; a < 3; ++a) {
    const real lower = t[CENTRE - axis[a]], upper = t[CENTRE + axis[a]];
    second[i + a * (size_t)stride] = fmax(lower, upper) < UNREACHED ? lower - 2 * T[i] + upper : UNREACHED;
  }
  for (int o = 0; o < 3; ++o) {
    const int a = axis[o == 2 ? 1 : 0], b = axis[o == 0 ? 1 : 2];
    const real pp = t[CENTRE + a + b], mm = t[CENTRE - a - b], pm = t[CENTRE + a - b], mp = t[CENTRE - a + b];
    second[i + (3 + o) * (size_t)stride] =
        fmax(fmax(pp, mm), fmax(pm, mp)) < UNREACHED ? R(0.25) * (pp + mm - pm - mp) : UNREACHED;
  }
}

// The smaller of two, 0 where their signs differ; of one alone where the other is missing.
inline real lesser(real p, real q) {
  if (!(fabs(p) < UNREACHED)) return fabs(q) < UNREACHED ? q : 0;
  if (!(fabs(q) < UNREACHED)) return p;
  return p * q > 0 ? (fabs(p) < fabs(q) ? p : q) : 0;
}

// One second difference at cell i; where a neighbour is missing, as in thin walls, the mean of those about it.
inline real second_difference(global const real *second, int i, global const int *first_cell, global const int *place,
                              global const int *linked, int grid_cells) {
  const real own = second[i];
  if (fabs(own) < UNREACHED) return own;
  const int cell = first_cell[i / LANES] + i % LANES, links = linked[i];
  real sum = 0, count = 0;
  for (int k = 0; k < 27; ++k) {
    if (!(links >> k & 1)) continue;
    const real other = second[neighbour_place(place, cell, k % 3 - 1 + NX * (k / 3 % 3 - 1 + NY * (k / 9 - 1)), grid_cells)];
    if (!(fabs(other) < UNREACHED)) continue;
    sum += other;
    ++count;
  }
  return count > 0 ? sum / count : UNREACHED;
}

// How much linear interpolation makes each cell late in a solution T, ms; second from above.
kernel void eikonal_correction(global const int *restrict first_cell, global const int *restrict place,
                               global const real *restrict T, global const real *restrict metric,
                               global const int *restrict linked, global const int *restrict in_sheet,
                               const int with_sheet, global const real *restrict second,
                               global real *restrict correction, const int stride, const int grid_cells) {
  const int i = get_global_id(0);
  correction[i] = 0;
  const int links = linked[i];
  if (links == 0 || !(T[i] < UNREACHED) || (with_sheet && in_sheet[i] != 0)) return;
  const int cell = first_cell[i / LANES] + i % LANES;
  const int axis[3] = {1, 3, 9}, step[3] = {1, NX, NX * NY};
  const real here = T[i];
  real g[3];  // grad T dx
  for (int a = 0; a < 3; ++a) {
    const int below = CENTRE - axis[a], above = CENTRE + axis[a];
    const real lower = links >> below & 1 ? T[neighbour_place(place, cell, -step[a], grid_cells)] : UNREACHED;
    const real upper = links >> above & 1 ? T[neighbour_place(place, cell, step[a], grid_cells)] : UNREACHED;
    // From the side the wave comes from, as the solver sees it: at a kink of the front centred ones would look across.
    g[a] = lower <= upper ? fmax(here - lower, R(0.0)) : -fmax(here - upper, R(0.0));
  }
  // The characteristic M g, up to a factor: the cofactors of G.
  const real xx = metric[i], yy = metric[i + (size_t)stride], zz = metric[i + 2 * (size_t)stride];
  const real xy = metric[i + 3 * (size_t)stride], xz = metric[i + 4 * (size_t)stride], yz = metric[i + 5 * (size_t)stride];
  const real cxy = xz * yz - xy * zz, cxz = xy * yz - xz * yy, cyz = xy * xz - yz * xx;
  const real w[3] = {(yy * zz - yz * yz) * g[0] + cxy * g[1] + cxz * g[2],
                     cxy * g[0] + (xx * zz - xz * xz) * g[1] + cyz * g[2],
                     cxz * g[0] + cyz * g[1] + (xx * yy - xy * xy) * g[2]};
  int order[3] = {0, 1, 2};  // axes, longest component first
  for (int pass = 0; pass < 3; ++pass) {
    const int p = pass % 2;
    if (fabs(w[order[p]]) < fabs(w[order[p + 1]])) {
      const int other = order[p];
      order[p] = order[p + 1];
      order[p + 1] = other;
    }
  }
  const real longest = fabs(w[order[0]]);
  if (!(longest > 0)) return;
  const real share2 = fabs(w[order[1]]) / longest, share3 = fabs(w[order[2]]) / longest;
  const real lambda[3] = {1 - share2, share2 - share3, share3};
  int corner[3], bits = CENTRE, offset = 0;
  real earliest = UNREACHED;
  for (int k = 0; k < 3; ++k) {
    const int towards = w[order[k]] > 0 ? -1 : 1;  // where the wave comes from
    bits += towards * axis[order[k]];
    offset += towards * step[order[k]];
    corner[k] = links >> bits & 1 ? neighbour_place(place, cell, offset, grid_cells) : VOID_CELL;
    if (lambda[k] > R(1e-3) && (corner[k] == VOID_CELL || !(T[corner[k]] < UNREACHED))) return;
    earliest = fmin(earliest, T[corner[k]]);
  }
  // Second differences along axis 2, axis 3 and their diagonal, at the corners.
  const int two = order[1], three = order[2];
  const real sign = w[two] * w[three] > 0 ? 2 : -2;
  real along2[3], along3[3], diagonal[3];
  for (int k = 0; k < 3; ++k) {
    const bool known = corner[k] != VOID_CELL && T[corner[k]] < UNREACHED;
    along2[k] = known ? second_difference(second + two * (size_t)stride, corner[k], first_cell, place, linked, grid_cells) : UNREACHED;
    along3[k] = known ? second_difference(second + three * (size_t)stride, corner[k], first_cell, place, linked, grid_cells) : UNREACHED;
    const real cross = known ? second_difference(second + (two + three + 2) * (size_t)stride, corner[k], first_cell, place, linked, grid_cells) : UNREACHED;
    diagonal[k] = fmax(fabs(along2[k]), fmax(fabs(along3[k]), fabs(cross))) < UNREACHED
                      ? along2[k] + along3[k] + sign * cross : UNREACHED;
  }
  const real late = R(0.5) * (lambda[0] * lambda[1] * lesser(along2[0], along2[1]) +
                              lambda[1] * lambda[2] * lesser(along3[1], along3[2]) +
                              lambda[0] * lambda[2] * lesser(diagonal[0], diagonal[2]));
  const real most = R(0.5) * fmax(here - earliest, R(0.0));  // keeps the wave going forward
  correction[i] = clamp(late, -most, most);
}

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
