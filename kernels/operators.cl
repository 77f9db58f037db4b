// Differential operators on a deformed grid, from the points of a lattice to the centres of its cells. The centres are a lattice
// themselves, so the same kernels go back from them: the grid is its own dual. Thesis, sections 4.1 and 4.3; equation
// names are those of its labels. kernels/README.md says where it is departed from.
//
// Every buffer is (members, components, points): points x fastest, one work-item each, members the second dimension of the
// launch. nx, ny, nz are the points of the lattice that is read; results of interpolate, gradient and divergence have one less
// along each axis, those of the others are on the same lattice, whose rim they leave alone.
// Coordinates (members, 3, points). Needs deformed_cell.clh and what it needs; WIDTH is that of common.clh.

// Point of a lattice of (nx, ny, nz) behind the number i of a smaller one, `rim` points off its lower faces.
inline int lattice_point(int i, int nx, int ny, int small_x, int small_y, int rim) {
  const int x = i % small_x, row = i / small_x;
  return (x + rim) + nx * ((row % small_y + rim) + ny * (row / small_y + rim));
}

inline int corner(int i, int k, int nx, int ny) { return i + (k & 1) + nx * ((k >> 1 & 1) + ny * (k >> 2)); }

inline void read_corners(global const real *x, size_t points, int i, int nx, int ny, real3 *c) {
  for (int k = 0; k < 8; ++k) c[k] = coordinates_of(x, points, corner(i, k, nx, ny));
}

// Of a cell with these corners: the cofactor of F, times `factor` over J.
inline Columns cofactor_over_J(const real3 *corners, real over_dx, real factor) {
  const Columns F = deformation_gradient(differences(corners), over_dx);
  const real scale = factor / determinant(F);
  Columns A = cofactor(F);
  A.x *= scale;
  A.y *= scale;
  A.z *= scale;
  return A;
}

// (refintp2) of every component.
kernel void interpolate(global const real *restrict u, global real *restrict result, const int components, const int nx,
                        const int ny, const int nz) {
  const int out = get_global_id(0), member = get_global_id(1), centres = (nx - 1) * (ny - 1) * (nz - 1);
  if (out >= centres) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 1, ny - 1, 0);
  for (int c = 0; c < components; ++c) {
    global const real *p = u + ((size_t)member * components + c) * points;
    real v[8];
    for (int k = 0; k < 8; ++k) v[k] = p[corner(i, k, nx, ny)];
    result[((size_t)member * components + c) * centres + out] =
        R(0.125) * (((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7])));
  }
}

// du/dx = du/dX F^-1, (defgrad2): result (members, components, 3, centres).
kernel void gradient(global const real *restrict x, global const real *restrict u, global real *restrict result,
                     const int components, const int nx, const int ny, const int nz, const real over_dx) {
  const int out = get_global_id(0), member = get_global_id(1), centres = (nx - 1) * (ny - 1) * (nz - 1);
  if (out >= centres) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 1, ny - 1, 0);
  real3 corners[8];
  read_corners(x + member * 3 * points, points, i, nx, ny, corners);
  const Columns F = deformation_gradient(differences(corners), over_dx), A = cofactor(F);
  const real scale = over_dx / determinant(F);
  for (int c = 0; c < components; ++c) {
    const size_t row = (size_t)member * components + c;
    real3 v[8];
    for (int k = 0; k < 8; ++k) v[k] = u[row * points + corner(i, k, nx, ny)];
    const Columns D = differences(v);
    const real3 g = scale * (D.x.x * A.x + D.y.x * A.y + D.z.x * A.z);
    result[(3 * row + 0) * centres + out] = g.x;
    result[(3 * row + 1) * centres + out] = g.y;
    result[(3 * row + 2) * centres + out] = g.z;
  }
}

// Fluxes through the six faces over the volume, (defdiv1), (defdiv2): u (members, rows, 3, points) to (members, rows, centres).
kernel void divergence(global const real *restrict x, global const real *restrict u, global real *restrict result,
                       const int rows, const int nx, const int ny, const int nz, const real over_dx) {
  const int out = get_global_id(0), member = get_global_id(1), centres = (nx - 1) * (ny - 1) * (nz - 1);
  if (out >= centres) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 1, ny - 1, 0);
  real3 corners[8];
  read_corners(x + member * 3 * points, points, i, nx, ny, corners);
  const real scale = over_dx / determinant(deformation_gradient(differences(corners), over_dx));
  for (int r = 0; r < rows; ++r) {
    global const real *row = u + ((size_t)member * rows + r) * 3 * points;
    real3 v[8];
    for (int k = 0; k < 8; ++k) {
      const size_t p = corner(i, k, nx, ny);
      v[k] = (real3)(row[p], row[p + points], row[p + 2 * points]);
    }
    // The faces close, so that a constant may be taken off; small numbers lose less to rounding.
    for (int k = 7; k >= 0; --k) v[k] -= v[0];
    real sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int b = 1 << (axis + 1) % 3, d = 1 << (axis + 2) % 3, up = 1 << axis;
      const real3 lower = R(0.25) * ((v[0] + v[b]) + (v[d] + v[b + d]));
      const real3 upper = R(0.25) * ((v[up] + v[up + b]) + (v[up + d] + v[up + b + d]));
      sum += dot(upper, face_area(corners, axis, 1, over_dx)) - dot(lower, face_area(corners, axis, 0, over_dx));
    }
    result[((size_t)member * rows + r) * centres + out] = scale * sum;
  }
}

inline int neighbour(int i, int m, int nx, int ny) { return i + m % 3 - 1 + nx * (m / 3 % 3 - 1 + ny * (m / 9 - 1)); }

// Corner j of cell k around a point, among its 27 neighbours.
inline int neighbour_of_cell(int k, int j) {
  return ((k & 1) + (j & 1)) + 3 * (((k >> 1 & 1) + (j >> 1 & 1)) + 3 * ((k >> 2) + (j >> 2)));
}

// Weights of the 27 neighbours in the Laplacian at their middle, from their coordinates: the product (ass3) from right to
// left. Area vectors of the faces of the dual cell, J F^-T n; shared out to its corners, where the gradients are; through
// F^-1 of the cells around the point; to the differences of the cells' corners.
void laplacian_weights_of(const real3 *x, real over_dx, real *weight) {
  real3 centre[8];
  Columns A[8];  // cofactor / (4 J dx^2)
  for (int k = 0; k < 8; ++k) {
    real3 c[8];
    for (int j = 0; j < 8; ++j) c[j] = x[neighbour_of_cell(k, j)];
    centre[k] = mean_of_corners(c);
    A[k] = cofactor_over_J(c, over_dx, R(0.25) * over_dx * over_dx);
  }
  const real over_J = 1 / determinant(deformation_gradient(differences(centre), over_dx));
  for (int m = 0; m < 27; ++m) weight[m] = 0;
  for (int k = 0; k < 8; ++k) {
    real3 area = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int upper = k >> axis & 1;
      area += (upper ? R(0.25) : -R(0.25)) * face_area(centre, axis, upper, over_dx);
    }
    area *= over_J;
    const real wx = dot(A[k].x, area), wy = dot(A[k].y, area), wz = dot(A[k].z, area);
    for (int j = 0; j < 8; ++j)
      weight[neighbour_of_cell(k, j)] += (j & 1 ? wx : -wx) + (j >> 1 & 1 ? wy : -wy) + (j >> 2 ? wz : -wz);
  }
}

inline void read_neighbours(global const real *x, size_t points, int i, int nx, int ny, real3 *n) {
  for (int m = 0; m < 27; ++m) n[m] = coordinates_of(x, points, neighbour(i, m, nx, ny));
}

inline void laplacian_weights_at(global const real *x, size_t points, int i, int nx, int ny, real over_dx, real *weight) {
  real3 n[27];
  read_neighbours(x, points, i, nx, ny, n);
  laplacian_weights_of(n, over_dx, weight);
}

// A row's sum over differences from the middle: the weights add up to nil, and differences lose less to rounding.
inline real apply_weights(const real *weight, global const real *u, int i, int nx, int ny) {
  const real middle = u[i];
  real sum = 0;
  for (int m = 0; m < 27; ++m) sum = fma(weight[m], u[neighbour(i, m, nx, ny)] - middle, sum);
  return sum;
}

// Laplacian of every component, without anything stored.
kernel void laplacian(global const real *restrict x, global const real *restrict u, global real *restrict result,
                      const int components, const int nx, const int ny, const int nz, const real over_dx) {
  const int out = get_global_id(0), member = get_global_id(1);
  if (out >= (nx - 2) * (ny - 2) * (nz - 2)) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 2, ny - 2, 1);
  real weight[27];
  laplacian_weights_at(x + member * 3 * points, points, i, nx, ny, over_dx, weight);
  for (int c = 0; c < components; ++c) {
    const size_t row = ((size_t)member * components + c) * points;
    result[row + i] = apply_weights(weight, u + row, i, nx, ny);
  }
}

// The first of the thesis's remedies for a point that is not in the middle of its dual cell: where it lies in it (three of
// Newton's steps; in three dimensions the equation is cubic), and the divergence of the trilinear gradients there.
kernel void laplacian_at_vertex(global const real *restrict x, global const real *restrict u, global real *restrict result,
                                const int components, const int nx, const int ny, const int nz, const real over_dx) {
  const int out = get_global_id(0), member = get_global_id(1);
  if (out >= (nx - 2) * (ny - 2) * (nz - 2)) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 2, ny - 2, 1);
  real3 n[27], centre[8];
  Columns inverse[8];  // F^-T / dx
  read_neighbours(x + member * 3 * points, points, i, nx, ny, n);
  for (int k = 0; k < 8; ++k) {
    real3 c[8];
    for (int j = 0; j < 8; ++j) c[j] = n[neighbour_of_cell(k, j)];
    centre[k] = mean_of_corners(c) - n[13];
    inverse[k] = cofactor_over_J(c, over_dx, over_dx);
  }
  real3 at = R(0.5);
  Columns A;
  real over_J = 0;
  for (int step_of_newton = 0; step_of_newton < 3; ++step_of_newton) {
    const real3 far = 1 - at;
    real3 miss = (at.x - R(0.5)) * along(0) + (at.y - R(0.5)) * along(1) + (at.z - R(0.5)) * along(2);
    for (int k = 0; k < 8; ++k)
      miss += (k & 1 ? at.x : far.x) * (k >> 1 & 1 ? at.y : far.y) * (k >> 2 ? at.z : far.z) * over_dx * centre[k];
    Columns F = deformation_gradient(differences_at(centre, at), over_dx);
    A = cofactor(F);
    over_J = 1 / determinant(F);
    at -= over_J * (real3)(dot(A.x, miss), dot(A.y, miss), dot(A.z, miss));
  }
  for (int c = 0; c < components; ++c) {
    const size_t row = ((size_t)member * components + c) * points;
    real3 g[8];
    for (int k = 0; k < 8; ++k) {
      real3 v[8];
      for (int j = 0; j < 8; ++j) v[j] = u[row + neighbour(i, neighbour_of_cell(k, j), nx, ny)];
      const Columns D = differences(v);
      g[k] = D.x.x * inverse[k].x + D.y.x * inverse[k].y + D.z.x * inverse[k].z;
    }
    const Columns D = differences_at(g, at);
    result[row + i] = over_dx * over_J * (dot(D.x, A.x) + dot(D.y, A.y) + dot(D.z, A.z));
  }
}

// Rows of the Laplacian, (members, 27, points), where they are used many times over.
kernel void laplacian_weights(global const real *restrict x, global real *restrict weights, const int nx, const int ny,
                              const int nz, const real over_dx) {
  const int out = get_global_id(0), member = get_global_id(1);
  if (out >= (nx - 2) * (ny - 2) * (nz - 2)) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 2, ny - 2, 1);
  real weight[27];
  laplacian_weights_at(x + member * 3 * points, points, i, nx, ny, over_dx, weight);
  for (int m = 0; m < 27; ++m) weights[((size_t)member * 27 + m) * points + i] = weight[m];
}

// One damped sweep of Jacobi's method on (identity - diffusion Laplacian) u = b: (dampjac1), and (iejac1) with identity 1 and
// diffusion nu dt; identity 0 and diffusion -1 is Laplacian u = b. Written as a correction by the residual. The rim is given.
kernel void jacobi(global const real *restrict x, global const real *restrict u, global const real *restrict b,
                   global real *restrict result, const int components, const int nx, const int ny, const int nz,
                   const real over_dx, const real identity, const real diffusion, const real damping) {
  const int out = get_global_id(0), member = get_global_id(1);
  if (out >= (nx - 2) * (ny - 2) * (nz - 2)) return;
  const size_t points = (size_t)nx * ny * nz;
  const int i = lattice_point(out, nx, ny, nx - 2, ny - 2, 1);
  real weight[27];
  laplacian_weights_at(x + member * 3 * points, points, i, nx, ny, over_dx, weight);
  const real scale = damping / (identity - diffusion * weight[13]);
  for (int c = 0; c < components; ++c) {
    const size_t row = ((size_t)member * components + c) * points;
    const real middle = u[row + i];
    const real residual = b[row + i] - identity * middle + diffusion * apply_weights(weight, u + row, i, nx, ny);
    result[row + i] = fma(scale, residual, middle);
  }
}

// The same from stored rows, for WIDTH consecutive points at a time, of the rim too: there the rows are nil. Buffers of u have
// WIDTH numbers of room behind them.
kernel void jacobi_stored(global const real *restrict weights, global const real *restrict u, global const real *restrict b,
                          global real *restrict result, const int components, const int nx, const int ny, const int nz,
                          const real identity, const real diffusion, const real damping) {
  const int first = 1 + nx * (1 + ny), points = nx * ny * nz;
  const int i = first + WIDTH * (int)get_global_id(0), member = get_global_id(1);
  if (i >= points - first) return;
  realv weight[27];
  for (int m = 0; m < 27; ++m) weight[m] = LOAD(weights + ((size_t)member * 27 + m) * points + i);
  const realv scale =
      WHERE(isequal(weight[13], (realv)(0)), (realv)(0), (realv)(damping) / ((realv)(identity) - diffusion * weight[13]));
  for (int c = 0; c < components; ++c) {
    const size_t row = ((size_t)member * components + c) * points;
    const realv middle = LOAD(u + row + i);
    realv sum = 0;
    for (int m = 0; m < 27; ++m) sum = fma(weight[m], LOAD(u + row + neighbour(i, m, nx, ny)) - middle, sum);
    const realv residual = LOAD(b + row + i) - identity * middle + diffusion * sum;
    STORE(fma(scale, residual, middle), result + row + i);
  }
}
