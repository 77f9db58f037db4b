// One V-cycle for the operator of elliptic.clh: aggregation of 2x2x2 cells, piecewise constant transfer,
// coarse conductances from the fine faces on each coarse face, red-black Gauss-Seidel.
// Piecewise constant transfer wants the Galerkin operator divided by two (Braess, Computing 55, 379
// (1995)); half the sum of the four fine conductances is just that, and equals rediscretisation. Where a good
// conductor ends inside a coarse cell half is still too much (coarsen_conductance). Sweeps before (red, black)
// and as many after (black, red) keep the cycle symmetric, as conjugate gradients need (Tatebe, NASA CP-3224,
// 621 (1993)).
//
// -D COARSEST_SWEEPS=n   red-black sweeps, and as many black-red ones, on the coarsest level
#ifndef COARSEST_SWEEPS
#error "multigrid.cl needs -D COARSEST_SWEEPS"
#endif

#define RED 0
#define BLACK 1

// The path of a fine face from the centre of one coarse cell to that of the next leads through the face and half
// of the face inside each coarse cell, in series: half the face's conductance when all three are alike. An inner face
// that conducts less than the outer one adds half of what it adds in series: half, since current need not
// go on along the line, at most DEAD_END times the outer face, since slivers of cut cells must not part coarse cells
// that hang together. One that conducts better adds nothing, nor does one that does not conduct: there the cell ends.
// Returns twice the resistance of the half path in units of the outer face's.
#define DEAD_END 6
real half_path(real inside, real face) {
  return inside > 0 && inside < face ? (real)0.5 * (1 + min(face / inside, (real)DEAD_END)) : 1;
}

// Conductances of the lower faces of the coarse cells: sum over the four fine faces on each. Range (nx, ny, nz), coarse.
// The first coarse cell's lower face is the fine boundary: its conductances are zero.
kernel void coarsen_conductance(int nx, int ny, int nz, int fine_nx, int fine_ny, int fine_nz,
                                global const real *restrict fine, global real *restrict coarse) {
  const int i = get_global_id(0) + 1, j = get_global_id(1) + 1, k = get_global_id(2) + 1;
  if (i > nx || j > ny || k > nz) return;
  const Strides s = strides(nx, ny, nz), f = strides(fine_nx, fine_ny, fine_nz);
  const int first = (2 * i - 1) + (2 * j - 1) * f.y + (2 * k - 1) * f.z;
  const int step[3] = {f.x, f.y, f.z};
  coarse += i + j * s.y + k * s.z;
  for (int axis = 0; axis < 3; ++axis, fine += f.cells, coarse += s.cells) {
    const int along = step[axis], across[2] = {step[(axis + 1) % 3], step[(axis + 2) % 3]};
    real sum = 0;
    for (int n = 0; n < 4; ++n) {
      // The second child may be the fine ghost: its own lower faces are zero, as are those of the ghosts beside it.
      const int c = first + (n & 1) * across[0] + (n >> 1) * across[1];
      const real face = fine[c];
      if (face > 0)
        sum += face / (1 + (real)0.5 * (half_path(fine[c - along], face) + half_path(fine[c + along], face)));
    }
    *coarse = sum;
  }
}

// 1 / sum of the face conductances. Range (nx, ny, nz).
kernel void invert_diagonal(int nx, int ny, int nz, global const real *restrict g,
                            global real *restrict inverse_diagonal) {
  const int i = get_global_id(0) + 1, j = get_global_id(1) + 1, k = get_global_id(2) + 1;
  if (i > nx || j > ny || k > nz) return;
  const Strides s = strides(nx, ny, nz);
  const int c = i + j * s.y + k * s.z;
  global const real *gy = g + s.cells, *gz = g + 2 * s.cells;
  const real sum = g[c] + g[c + s.x] + gy[c] + gy[c + s.y] + gz[c] + gz[c + s.z];
  inverse_diagonal[c] = sum > 0 ? 1 / sum : 0;
}

// The cell of one colour that a work-item of range (ceil(nx/2), ny, nz*fields) updates; none when i > nx.
#define CELL_OF_COLOUR(colour)                                                                     \
  const int j = get_global_id(1) + 1, k = get_global_id(2) % nz + 1, field = get_global_id(2) / nz; \
  const int i = 2 * get_global_id(0) + 1 + ((j + k + 1 + (colour)) & 1);                            \
  if (i > nx || j > ny) return;                                                                     \
  const Strides s = strides(nx, ny, nz);                                                            \
  const int c = i + j * s.y + k * s.z

// Gauss-Seidel on one colour.
kernel void smooth(int colour, int nx, int ny, int nz, global const real *restrict g,
                   global const real *restrict inverse_diagonal, global const real *restrict b, global real *x) {
  CELL_OF_COLOUR(colour);
  b += field * s.cells;
  x += field * s.cells;
  x[c] = inverse_diagonal[c] * (b[c] + neighbours(g, x, c, s));
}

// Red, then black, from x = 0: the red values are b / diagonal, and the next red sweep would overwrite them.
kernel void smooth_from_zero(int nx, int ny, int nz, global const real *restrict g,
                             global const real *restrict inverse_diagonal, global const real *restrict b,
                             global real *restrict x) {
  CELL_OF_COLOUR(BLACK);
  b += field * s.cells;
  x += field * s.cells;
  const int step[3] = {s.x, s.y, s.z};
  real sum = b[c];
  for (int axis = 0; axis < 3; ++axis, g += s.cells) {
    const int lower = c - step[axis], upper = c + step[axis];
    sum += g[c] * inverse_diagonal[lower] * b[lower] + g[upper] * inverse_diagonal[upper] * b[upper];
  }
  x[c] = inverse_diagonal[c] * sum;
}

// Adds the coarse correction and sweeps black. Only red values enter, and the next red sweep overwrites
// them, so the correction itself need not be stored.
kernel void smooth_corrected(int nx, int ny, int nz, int coarse_nx, int coarse_ny, int coarse_nz,
                             global const real *restrict g, global const real *restrict inverse_diagonal,
                             global const real *restrict b, global const real *restrict correction,
                             global real *x) {
  CELL_OF_COLOUR(BLACK);
  const Strides t = strides(coarse_nx, coarse_ny, coarse_nz);
  b += field * s.cells;
  x += field * s.cells;
  correction += field * t.cells;
  const int step[3] = {s.x, s.y, s.z}, coarse_step[3] = {t.x, t.y, t.z}, place[3] = {i, j, k};
  const int parent = (i + 1) / 2 + (j + 1) / 2 * t.y + (k + 1) / 2 * t.z;
  real sum = b[c];
  for (int axis = 0; axis < 3; ++axis, g += s.cells) {
    // Of the two neighbours along an axis one shares the parent: the lower one of even cells (counted from 1).
    const int even = (place[axis] & 1) == 0;
    const int lower = c - step[axis], upper = c + step[axis];
    sum += g[c] * (x[lower] + correction[even ? parent : parent - coarse_step[axis]]) +
           g[upper] * (x[upper] + correction[even ? parent + coarse_step[axis] : parent]);
  }
  x[c] = inverse_diagonal[c] * sum;
}

// Coarse right-hand side: the residual b - A x summed over the children. After a black sweep the black
// ones have none. Range (coarse nx, ny, nz*fields).
kernel void restrict_residual(int nx, int ny, int nz, int fine_nx, int fine_ny, int fine_nz,
                              global const real *restrict g, global const real *restrict b,
                              global const real *restrict x, global real *restrict coarse_b) {
  const int i = get_global_id(0) + 1, j = get_global_id(1) + 1, k = get_global_id(2) % nz + 1;
  const int field = get_global_id(2) / nz;
  if (i > nx || j > ny) return;
  const Strides s = strides(nx, ny, nz), f = strides(fine_nx, fine_ny, fine_nz);
  b += field * f.cells;
  x += field * f.cells;
  real sum = 0;
  for (int fk = 2 * k - 1; fk <= min(2 * k, fine_nz); ++fk)
    for (int fj = 2 * j - 1; fj <= min(2 * j, fine_ny); ++fj) {
      const int fi = 2 * i - 1 + ((fj + fk + 1 + RED) & 1);
      if (fi > fine_nx) continue;
      const int c = fi + fj * f.y + fk * f.z;
      sum += b[c] - apply_operator(g, x, c, f);
    }
  coarse_b[field * s.cells + i + j * s.y + k * s.z] = sum;
}

// The coarsest level: COARSEST_SWEEPS red-black and as many black-red sweeps from x = 0, one work-group a
// field.
kernel void smooth_coarsest(int nx, int ny, int nz, global const real *restrict g,
                            global const real *restrict inverse_diagonal, global const real *restrict b,
                            global real *x) {
  const Strides s = strides(nx, ny, nz);
  b += get_group_id(0) * s.cells;
  x += get_group_id(0) * s.cells;
  for (int c = get_local_id(0); c < s.cells; c += get_local_size(0)) x[c] = 0;
  barrier(CLK_GLOBAL_MEM_FENCE);
  for (int half_sweep = 0; half_sweep < 4 * COARSEST_SWEEPS; ++half_sweep) {
    const int colour = half_sweep < 2 * COARSEST_SWEEPS ? half_sweep & 1 : ~half_sweep & 1;
    for (int n = get_local_id(0); n < nx * ny * nz; n += get_local_size(0)) {
      const int i = n % nx + 1, j = n / nx % ny + 1, k = n / (nx * ny) + 1;
      if (((i + j + k) & 1) != colour) continue;
      const int c = i + j * s.y + k * s.z;
      x[c] = inverse_diagonal[c] * (b[c] + neighbours(g, x, c, s));
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
  }
}
