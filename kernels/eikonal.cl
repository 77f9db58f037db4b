// Metric, links and correction of arrival times. Needs segments.clh, field_gradient.clh, eikonal.clh and, for the width of vectors, -D WIDTH.

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
