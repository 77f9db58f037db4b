// How fast a stencil of diffusion is. Needs segments.clh, diffusion.clh and -D BLOCK (cells of a block).
#ifndef BLOCK
#error "diffusion_bound.cl needs BLOCK"
#endif

// Gershgorin's bound of the diffusion operator's largest |eigenvalue| (1/ms), by block: twice the sum of |couplings|
// over the cell's capacity, at its largest. An explicit step is stable up to 2 / bound.
kernel void diffusion_bound(global const real *restrict stencil, global const real *restrict inverse_capacity,
                            global const int8 *restrict neighbours, global real *restrict bound, const int stride,
                            const int blocks) {
  const int block = get_global_id(0);
  if (block >= blocks) return;
  global const real *x = stencil, *y = x + (size_t)stride, *z = y + (size_t)stride;
  global const real *xy = z + (size_t)stride, *xz = xy + (size_t)stride, *yz = xz + (size_t)stride;
  realv largest = 0;
  for (int k = 0; k < BLOCK; k += WIDTH) {
    const int i = FIRST_CELL + block * BLOCK + k;
    const Rows r = neighbour_rows(neighbours, i);
    realv s = LOAD(x + i) + LOAD(x + i + 1) + LOAD(y + i) + LOAD(y + r.yp) + LOAD(z + i) + LOAD(z + r.zp);
    s += fabs(LOAD(xy + i)) + fabs(LOAD(xy + r.yp + 1)) + fabs(LOAD(xy + i + 1)) + fabs(LOAD(xy + r.yp));
    s += fabs(LOAD(xz + i)) + fabs(LOAD(xz + r.zp + 1)) + fabs(LOAD(xz + i + 1)) + fabs(LOAD(xz + r.zp));
    s += fabs(LOAD(yz + i)) + fabs(LOAD(yz + r.yp_zp)) + fabs(LOAD(yz + r.yp)) + fabs(LOAD(yz + r.zp));
    largest = fmax(largest, 2 * s * LOAD(inverse_capacity + i));
  }
  real result = 0;
  for (int k = 0; k < WIDTH; ++k) result = fmax(result, LANE(largest, k));
  bound[block] = result;
}
