// Assembly of the diffusion operator div(D grad u) on the tissue: a symmetric graph Laplacian of 18 neighbours.
//
// The operator is the gradient of an energy that is a sum over vertices of the grid. A vertex whose eight cells are all
// tissue has D = the mean of theirs and contributes
//     1/2 sum_a D_aa (mean over its four a-faces of the squared difference) + sum_{a<b} D_ab (g_a g_b),
// with g_a g_b averaged over its two ab-plaquettes and g_a the mean of the plaquette's two a-differences. On uniform
// tissue this is the scheme of compact normal differences with averaged tangential ones: second order, and its Fourier
// symbol  sum_ab D_ab w_a w_b + sum_a D_aa s_a^4/4,  s_a = 2 sin(k_a h/2), w_a = sin(k_a h),  vanishes for k = 0 alone,
// so it has no checkerboard modes. Because each vertex's energy is positive, the operator is negative semi-definite for any
// set of cells. With p, q the two diagonal differences of a plaquette, g_a g_b = (p^2 - q^2)/4: a cross term is a
// coupling +-D_ab/2 across the diagonals, which is how diffusion.clh applies it.
//
// At a flat boundary a vertex has the four cells of one plaquette, at an edge the two of one face. There is no flux
// through what is missing, so the gradient across it takes the value that makes the energy least: D gives way to its
// Schur complement, D_ab - D_an D_bn / D_nn for a missing axis n. Without it oblique fibres at a boundary cost an order.
// Vertices with any other set of cells (steps of a curved surface) keep plain D_aa, and the cross terms of their complete
// plaquettes: all of them if these lie in one orientation, half of them otherwise, which is what positivity allows.
//
// Cells cut by the surface hold a fraction of tissue. Vertices weigh as the smallest of the cells they have; faces as the
// smaller of their two, so that no cut cell shortens the explicit step. That is right for potentials without flux through
// the surface, whose gradient across the last half cell is nil. The ECG's source has no such condition and no need of
// positivity: source_faces.cl.
//
// With MODE_LAYERED the means are those of layers in series and parallel: exact, and second order, where the
// conductivity jumps across a plane of the grid (tissue and bath), whose normal flux is continuous. Without a jump they
// differ from the arithmetic mean to second order.
//
// conductivity: (6, stride) xx yy zz xy xz yz of each cell, scaled so that the result is in 1/ms (diffusivity / dx^2).
// stencil: (6, stride) couplings to the lower x, y, z neighbour; diagonal couplings of the lower xy, xz, yz plaquette.
// Needs segments.clh and conductivity.cl.

enum { MODE_POTENTIAL, MODE_LAYERED };

constant int cross_of[3][3] = {{-1, 3, 4}, {3, -1, 5}, {4, 5, -1}};  // where D_ab stands behind xx yy zz

typedef struct {
  real weight;      // smallest fraction of its cells; 0 where they are neither all eight, nor a plaquette, nor a face's two
  real tensor[6];   // their mean, reduced by what is missing: xx yy zz xy xz yz; with weight > 0
  int oriented;     // bit o: a complete plaquette of orientation o; with weight 0
} Vertex;

// What is left of a tensor where there is no flux along axis n.
void reduce_tensor(real *D, int n) {
  if (!(D[n] > 0)) return;
  for (int a = 0; a < 3; ++a) {
    if (a == n) continue;
    const real ratio = D[cross_of[a][n]] / D[n];
    for (int b = a; b < 3; ++b)
      if (b != n) D[a == b ? a : cross_of[a][b]] -= ratio * D[cross_of[b][n]];
  }
  D[n] = 0;
  for (int a = 0; a < 3; ++a)
    if (a != n) D[cross_of[a][n]] = 0;
}

// Mean of two tensors in layers normal to axis n, into a: gradients along the layers and the flux across them are common
// (Milton, The Theory of Composites, section 9.2).
void layer(real *a, const real *b, int n) {
  const real sum = a[n] + b[n], normal = a[n] > 0 && b[n] > 0 ? 2 * a[n] * b[n] / sum : 0;
  real ratio[3], tangential[6];
  for (int p = 0; p < 3; ++p) {
    if (p == n) continue;
    const int c = cross_of[p][n];
    ratio[p] = normal > 0 ? R(0.5) * (a[c] / a[n] + b[c] / b[n]) : 0;
  }
  for (int p = 0; p < 3; ++p)
    for (int q = p; q < 3; ++q) {
      if (p == n || q == n) continue;
      const int c = p == q ? p : cross_of[p][q], cp = cross_of[p][n], cq = cross_of[q][n];
      const real of_a = a[n] > 0 ? a[cp] * a[cq] / a[n] : 0, of_b = b[n] > 0 ? b[cp] * b[cq] / b[n] : 0;
      tangential[c] = R(0.5) * (a[c] - of_a + b[c] - of_b) + normal * ratio[p] * ratio[q];
    }
  for (int p = 0; p < 3; ++p)
    for (int q = p; q < 3; ++q) {
      const int c = p == q ? p : cross_of[p][q];
      a[c] = p == n && q == n ? normal : p == n ? normal * ratio[q] : q == n ? normal * ratio[p] : tangential[c];
    }
}

// The vertex at corner (cx, cy, cz), each 0 (lower) or 1 (upper), of grid cell `cell`.
Vertex vertex_at(global const int *place, int cell, int cx, int cy, int cz, global const real *capacity,
                 global const real *conductivity, int stride, int grid_cells, int mode) {
  Vertex v;
  int cells[8], present = 0, count = 0;
  v.weight = 1;
  v.oriented = 0;
  for (int k = 0; k < 8; ++k) {
    cells[k] = place_of(place, cell, cx - 1 + (k & 1), cy - 1 + (k >> 1 & 1), cz - 1 + (k >> 2), grid_cells);
    const real share = capacity[cells[k]];
    if (!(share > 0)) continue;
    present |= 1 << k;
    ++count;
    v.weight = fmin(v.weight, share);
  }
  // Axes along which all present cells lie on one side: lower (bit of the axis clear) or upper.
  const int upper[3] = {0xAA, 0xCC, 0xF0};
  int missing = 0;
  for (int a = 0; a < 3; ++a)
    if ((present & upper[a]) == 0 || (present & upper[a]) == present) missing |= 1 << a;
  const int axes = 3 - (missing & 1) - (missing >> 1 & 1) - (missing >> 2);
  if (count == 1 << axes && axes > 0) {
    if (mode == MODE_LAYERED) {
      real tensors[8][6];
      int left = present;
      for (int k = 0; k < 8; ++k)
        for (int c = 0; c < 6; ++c) tensors[k][c] = conductivity[cells[k] + c * (size_t)stride];
      for (int a = 0; a < 3; ++a) {
        if (missing >> a & 1) continue;
        for (int k = 0; k < 8; ++k)
          if ((left >> k & 1) && !(k >> a & 1)) layer(tensors[k], tensors[k | 1 << a], a);
        left &= ~upper[a];
      }
      for (int k = 0; k < 8; ++k)
        if (left >> k & 1)
          for (int c = 0; c < 6; ++c) v.tensor[c] = tensors[k][c];
    } else {
      for (int c = 0; c < 6; ++c) v.tensor[c] = 0;
      for (int k = 0; k < 8; ++k)
        if (present >> k & 1)
          for (int c = 0; c < 6; ++c) v.tensor[c] += conductivity[cells[k] + c * (size_t)stride] / count;
    }
    for (int a = 0; a < 3; ++a)
      if (missing >> a & 1) reduce_tensor(v.tensor, a);
  } else {
    v.weight = 0;
    for (int o = 0; o < 3; ++o) {
      const int a = 1 << plaquette_axes[o][0], b = 1 << plaquette_axes[o][1], n = 7 - a - b;
      for (int side = 0; side <= n; side += n) {
        const int plaquette = 1 << side | 1 << (side + a) | 1 << (side + b) | 1 << (side + a + b);
        if ((present & plaquette) == plaquette) v.oriented |= 1 << o;
      }
    }
  }
  return v;
}

kernel void assemble_stencil(global const int *restrict first_cell, global const int *restrict place,
                             global const real *restrict capacity, global const real *restrict conductivity,
                             global real *restrict stencil, const int stride, const int mode, const int grid_cells) {
  const int i = get_global_id(0);
  const int cell = first_cell[i / LANES] + i % LANES;
  real coupling[6] = {0, 0, 0, 0, 0, 0};
  if (capacity[i] > 0) {
    // Lower faces: the four vertices of each, then what the face weighs beyond them.
    for (int a = 0; a < 3; ++a) {
      const int lower = place_of(place, cell, a == 0 ? -1 : 0, a == 1 ? -1 : 0, a == 2 ? -1 : 0, grid_cells);
      if (!(capacity[lower] > 0)) continue;
      const real face = fmin(capacity[i], capacity[lower]);
      const real here = conductivity[i + a * (size_t)stride], there = conductivity[lower + a * (size_t)stride];
      const real normal = mode == MODE_LAYERED ? (here > 0 && there > 0 ? 2 * here * there / (here + there) : 0)
                                               : R(0.5) * (here + there);
      for (int k = 0; k < 4; ++k) {
        const int u = k & 1, w = k >> 1;
        const Vertex v = vertex_at(place, cell, a == 0 ? 0 : u, a == 1 ? 0 : (a == 0 ? u : w), a == 2 ? 0 : w, capacity,
                                   conductivity, stride, grid_cells, mode);
        coupling[a] += R(0.25) * (v.weight > 0 ? v.weight * v.tensor[a] + (face - v.weight) * normal : face * normal);
      }
    }
    // Lower plaquettes: the two vertices of each.
    for (int o = 0; o < 3; ++o) {
      const int a = plaquette_axes[o][0], b = plaquette_axes[o][1];
      real least = capacity[i], mean = 0, smallest = 1e30f, largest = -1e30f;
      for (int k = 0; k < 4; ++k) {
        const int da = -(k & 1), db = -(k >> 1);
        const int corner = place_of(place, cell, a == 0 ? da : 0, a == 1 ? da : (b == 1 ? db : 0), b == 2 ? db : 0, grid_cells);
        least = fmin(least, capacity[corner]);
        const real there = conductivity[corner + (3 + o) * (size_t)stride];
        mean += R(0.25) * there;
        smallest = fmin(smallest, there);
        largest = fmax(largest, there);
      }
      // Of layers without a complete vertex, what all four cells have.
      if (mode == MODE_LAYERED) mean = smallest > 0 ? smallest : fmin(largest, R(0.0));
      if (!(least > 0)) continue;
      for (int side = 0; side < 2; ++side) {
        const Vertex v = vertex_at(place, cell, o == 2 ? side : 0, o == 1 ? side : 0, o == 0 ? side : 0, capacity,
                                   conductivity, stride, grid_cells, mode);
        const bool alone = (v.oriented & (v.oriented - 1)) == 0;
        coupling[3 + o] += R(0.5) * (v.weight > 0 ? v.weight * v.tensor[3 + o] : (alone ? R(1.0) : R(0.5)) * least * mean);
      }
      coupling[3 + o] *= R(0.5);  // across the diagonals
    }
  }
  for (int c = 0; c < 6; ++c) stencil[i + c * (size_t)stride] = coupling[c];
}
