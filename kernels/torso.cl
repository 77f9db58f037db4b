// The torso on its grid: level set, face conductances of cut cells, unit currents at the electrodes,
// continuation of the potentials beyond the skin. Indexing: elliptic.clh.
// The flux through a cut face is the part of its area inside times the difference of the two cells' values
// (Purvis & Burkhalter, AIAA J. 17, 526 (1979); Ng, Min & Gibou, J. Comput. Phys. 228, 8807 (2009)):
// symmetric, and of second order with an insulated boundary.
//
// -D TORSO_BOX, TORSO_ELLIPSOID or TORSO_CYLINDER   the shape (cylinder: vertical, superelliptic
// cross-section)
#if !defined(TORSO_BOX) && !defined(TORSO_ELLIPSOID) && !defined(TORSO_CYLINDER)
#error "torso.cl needs -D TORSO_BOX, TORSO_ELLIPSOID or TORSO_CYLINDER"
#endif

// Negative inside. (x, y, z): from the torso's centre in units of its half-extents.
real torso_level(real x, real y, real z, real exponent) {
  x = fabs(x);
  y = fabs(y);
  z = fabs(z);
#if defined(TORSO_BOX)
  return fmax(fmax(x, y), z) - 1;
#elif defined(TORSO_ELLIPSOID)
  return sqrt(x * x + y * y + z * z) - 1;
#else
  return fmax(pow(pow(x, exponent) + pow(y, exponent), 1 / exponent), z) - 1;
#endif
}

// Level set at the corners of the cells: shape (nz+1, ny+1, nx+1), the range. (ox, oy, oz): first corner and
// (dx, dy, dz): spacing, both in units of the half-extents.
kernel void torso_level_set(int nx, int ny, int nz, real ox, real oy, real oz, real dx, real dy, real dz,
                            real exponent, global real *restrict level) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2);
  if (i > nx || j > ny || k > nz) return;
  level[i + (nx + 1) * (j + (ny + 1) * k)] = torso_level(ox + i * dx, oy + j * dy, oz + k * dz, exponent);
}

// Part of a triangle where the linear interpolant of its corner values is negative.
real triangle_fraction(real a, real b, real c) {
  const real low = fmin(fmin(a, b), c), high = fmax(fmax(a, b), c), mid = fmax(fmin(a, b), fmin(fmax(a, b), c));
  if (high < 0) return 1;
  if (low >= 0) return 0;
  if (mid < 0) return 1 - high * high / ((high - low) * (high - mid));
  return low * low / ((low - mid) * (low - high));
}

// Part of a square where the level set is negative; corners in order around it. Slivers do not conduct.
real square_fraction(real a, real b, real c, real d) {
  const real sliver = (real)1e-3;
  const real centre = (real)0.25 * (a + b + c + d);
  const real fraction = (real)0.25 * (triangle_fraction(a, b, centre) + triangle_fraction(b, c, centre) +
                                      triangle_fraction(c, d, centre) + triangle_fraction(d, a, centre));
  return fraction < sliver ? 0 : fraction;
}

// Conductances of the lower faces for sigma = 1: area inside / dx, in mm. Range (nx, ny, nz).
kernel void torso_conductance(int nx, int ny, int nz, real dx, global const real *restrict level,
                              global real *restrict g) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2);
  if (i >= nx || j >= ny || k >= nz) return;
  const Strides s = strides(nx, ny, nz);
  const int c = (i + 1) + (j + 1) * s.y + (k + 1) * s.z;
  const int row = nx + 1, plane = (nx + 1) * (ny + 1);
  level += i + j * row + k * plane;
  const real v000 = level[0], v100 = level[1], v010 = level[row], v110 = level[row + 1];
  const real v001 = level[plane], v101 = level[plane + 1], v011 = level[plane + row];
  g[c] = i > 0 ? dx * square_fraction(v000, v010, v011, v001) : 0;
  g[c + s.cells] = j > 0 ? dx * square_fraction(v000, v100, v101, v001) : 0;
  g[c + 2 * s.cells] = k > 0 ? dx * square_fraction(v000, v100, v110, v010) : 0;
}

// Ratio of the conductivity in cell (i, j, k) to the torso's: of the first of n ellipsoids (centre, semi-axes in cells,
// ratio) that holds its centre.
real inclusion_ratio(int i, int j, int k, int n, global const real *e) {
  for (; n > 0; --n, e += 7) {
    const real x = (i - e[0]) / e[3], y = (j - e[1]) / e[4], z = (k - e[2]) / e[5];
    if (x * x + y * y + z * z < 1) return e[6];
  }
  return 1;
}

// Conductances between cells of other conductivity: in series. Range (nx, ny, nz).
kernel void torso_inclusions(int nx, int ny, int nz, int n, global const real *restrict ellipsoids,
                             global real *restrict g) {
  const int i = get_global_id(0) + 1, j = get_global_id(1) + 1, k = get_global_id(2) + 1;
  if (i > nx || j > ny || k > nz) return;
  const Strides s = strides(nx, ny, nz);
  const int c = i + j * s.y + k * s.z;
  const real here = inclusion_ratio(i, j, k, n, ellipsoids);
  for (int axis = 0; axis < 3; ++axis) {
    const real there = inclusion_ratio(i - (axis == 0), j - (axis == 1), k - (axis == 2), n, ellipsoids);
    g[c + axis * s.cells] *= 2 * here * there / (here + there);
  }
}

// A unit current at each electrode, spread over the conducting cells around it by the moving least squares
// weights w_i = theta_i (l0 + l . (x_i - x_e)): sum w_i = 1 and sum w_i x_i = x_e exactly, also on the
// skin, where all cells lie to one side. The same weights read a potential at an electrode (Lancaster &
// Salkauskas, Math. Comp. 37, 141 (1981)). One work-item an electrode. place: (electrodes, 3), in cells,
// the centre of cell (i, j, k) at (i, j, k). b: zeroed before; untouched unless `inject`. weights: (electrodes, 4, 4, 4), first:
// (electrodes, 3): those weights and the cell of the first of them.
kernel void electrode_currents(int nx, int ny, int nz, real dx, global const real *restrict g,
                               global const real *restrict place, global real *b,
                               global real *weights, global int *restrict first, int inject) {
  const int e = get_global_id(0);
  const Strides s = strides(nx, ny, nz);
  global const real *gy = g + s.cells, *gz = g + 2 * s.cells;
  const real reach = (real)2.25;  // cells, where theta falls to zero
  const int extent[3] = {nx, ny, nz};
  int low[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = clamp((int)floor(place[3 * e + axis]) - 1, 1, max(extent[axis] - 3, 1));
    first[3 * e + axis] = low[axis];
  }
  weights += 64 * e;
  b += e * s.cells;

  real m[4][5] = {{0}};  // moment matrix and right-hand side
  m[0][4] = 1;
  for (int pass = 0; pass < 2; ++pass) {
    for (int n = 0; n < 64; ++n) {
      const int i = low[0] + n % 4, j = low[1] + n / 4 % 4, k = low[2] + n / 16;
      real theta = 0;
      real basis[4] = {1, i - place[3 * e], j - place[3 * e + 1], k - place[3 * e + 2]};
      const int c = i + j * s.y + k * s.z;
      if (i <= nx && j <= ny && k <= nz) {
        const real inside = (g[c] + g[c + s.x] + gy[c] + gy[c + s.y] + gz[c] + gz[c + s.z]) / (6 * dx);
        const real distance =
            sqrt(basis[1] * basis[1] + basis[2] * basis[2] + basis[3] * basis[3]) / reach;
        if (distance < 1) theta = inside * (1 - distance) * (1 - distance);
      }
      if (pass == 0) {
        for (int p = 0; p < 4; ++p)
          for (int q = 0; q < 4; ++q) m[p][q] += theta * basis[p] * basis[q];
      } else {
        real w = 0;
        for (int p = 0; p < 4; ++p) w += basis[p] * m[p][4];
        weights[n] = theta * w;
        if (inject && theta > 0) b[c] = theta * w;
      }
    }
    if (pass == 0)  // Gauss-Jordan; the matrix is symmetric and positive: no pivoting
      for (int p = 0; p < 4; ++p) {
        const real inverse = 1 / m[p][p];
        for (int q = p; q < 5; ++q) m[p][q] *= inverse;
        for (int r = 0; r < 4; ++r) {
          if (r == p) continue;
          const real factor = m[r][p];
          for (int q = p; q < 5; ++q) m[r][q] -= factor * m[p][q];
        }
      }
  }
}

// Continues x into the cells outside that lie within two cells of conducting ones, by their mean weighted
// with the inverse squared distance: the skin is insulated, so nothing changes across it to first order.
// Range (nx+2, ny+2, (nz+2)*fields), ghosts included.
kernel void continue_outside(int nx, int ny, int nz, global const real *restrict inverse_diagonal, global real *x) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2) % (nz + 2);
  const int field = get_global_id(2) / (nz + 2);
  if (i > nx + 1 || j > ny + 1) return;
  const Strides s = strides(nx, ny, nz);
  const int c = i + j * s.y + k * s.z;
  if (inverse_diagonal[c] > 0) return;
  x += field * s.cells;
  real sum = 0, total = 0;
  for (int dk = max(-2, -k); dk <= min(2, nz + 1 - k); ++dk)
    for (int dj = max(-2, -j); dj <= min(2, ny + 1 - j); ++dj)
      for (int di = max(-2, -i); di <= min(2, nx + 1 - i); ++di) {
        const int n = c + di + dj * s.y + dk * s.z;
        if (!(inverse_diagonal[n] > 0)) continue;
        const real weight = 1 / (real)(di * di + dj * dj + dk * dk);
        sum += weight * x[n];
        total += weight;
      }
  if (total > 0) x[c] = sum / total;
}
