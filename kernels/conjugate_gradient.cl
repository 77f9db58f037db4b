// Preconditioned conjugate gradients (Hestenes & Stiefel 1952; Saad, Iterative Methods, alg. 9.1) for all
// right-hand sides at once, on the singular operator of elliptic.clh: the constant is kept out of b and of
// the search directions. alpha, beta and the sums stay on the device. Each sum is taken in a fixed order:
// CHUNKS partial sums a field, then those by one work-group.
//
// -D CHUNKS=n   partial sums of a field
// -D GROUP=n    work-items of the group that adds them: 1 on CPUs, a power of two on GPUs
// -D GPU        a chunk is every CHUNKS-th cell (coalesced); else contiguous cells
#if !defined(CHUNKS) || !defined(GROUP)
#error "conjugate_gradient.cl needs -D CHUNKS and GROUP"
#endif

#ifdef GPU
#define FOR_CHUNK(c, cells) for (int c = get_global_id(0); c < (cells); c += CHUNKS)
#else
#define FOR_CHUNK(c, cells)                                                               \
  const int chunk_length = ((cells) + CHUNKS - 1) / CHUNKS;                               \
  const int chunk_end = min((int)(get_global_id(0) + 1) * chunk_length, (int)(cells));    \
  for (int c = get_global_id(0) * chunk_length; c < chunk_end; ++c)
#endif

// Of each field, in this order: what the steps of the iteration hand on.
enum { CELLS, MEAN, RZ, BETA, ALPHA, RR, BB, SCALARS };
enum { SUMS = 2 };

// The two partial sums of this work-item: partial has shape (fields, SUMS, CHUNKS).
void store_partial(global accumulator *partial, accumulator a, accumulator b) {
  partial += get_global_id(1) * SUMS * CHUNKS + get_global_id(0);
  partial[0] = a;
  partial[CHUNKS] = b;
}

// Sum `which` of the field of this work-group. All its work-items must call.
accumulator total(global const accumulator *partial, int which, local accumulator *scratch) {
  const int lane = get_local_id(0);
  partial += (get_group_id(0) * SUMS + which) * CHUNKS;
  accumulator sum = 0;
  for (int n = lane; n < CHUNKS; n += GROUP) sum += partial[n];
#if GROUP > 1
  scratch[lane] = sum;
  for (int lanes = GROUP / 2; lanes > 0; lanes /= 2) {
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < lanes) scratch[lane] += scratch[lane + lanes];
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  sum = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
#endif
  return sum;
}

// Partial sums of b over the active cells, and their number. Range of all partial sums: (CHUNKS, fields).
kernel void sum_source(int cells, global const real *restrict inverse_diagonal, global const real *restrict b,
                       global accumulator *restrict partial) {
  b += get_global_id(1) * cells;
  accumulator sum = 0, active = 0;
  FOR_CHUNK(c, cells) {
    const bool open = inverse_diagonal[c] > 0;
    sum += open ? b[c] : 0;
    active += open ? 1 : 0;
  }
  store_partial(partial, sum, active);
}

// Mean of b and number of cells. Range of all totals: (GROUP * fields), groups of GROUP.
kernel void finish_source(global const accumulator *restrict partial, global accumulator *scalars) {
  local accumulator scratch[GROUP];
  const accumulator sum = total(partial, 0, scratch), active = total(partial, 1, scratch);
  if (get_local_id(0) > 0) return;
  scalars += get_group_id(0) * SCALARS;
  scalars[CELLS] = active;
  scalars[MEAN] = sum / max(active, (accumulator)1);
  scalars[RZ] = 0;
}

// r = b - mean(b) - A x; partial sums of r.r and of (b - mean(b)).(b - mean(b)).
kernel void residual(int nx, int ny, int nz, global const real *restrict g, CROSS_ARGUMENT
                     global const real *restrict inverse_diagonal, global const real *restrict b,
                     global const real *restrict x, global const accumulator *restrict scalars,
                     global real *restrict r, global accumulator *restrict partial) {
  const Strides s = strides(nx, ny, nz);
  const int field = get_global_id(1);
  b += field * s.cells;
  x += field * s.cells;
  r += field * s.cells;
  const real mean = scalars[field * SCALARS + MEAN];
  accumulator rr = 0, bb = 0;
  FOR_CHUNK(c, s.cells) {
    if (!(inverse_diagonal[c] > 0)) {  // may have conducted in the last solve
      r[c] = 0;
      continue;
    }
    const real source = b[c] - mean;
    real outflow = apply_operator(g, x, c, s);
    ADD_CROSS(outflow, x, c, s);
    r[c] = source - outflow;
    rr += (accumulator)r[c] * r[c];
    bb += (accumulator)source * source;
  }
  store_partial(partial, rr, bb);
}

// Squares of the residual and of the right-hand side.
kernel void finish_residual(int with_source, global const accumulator *restrict partial,
                            global accumulator *scalars) {
  local accumulator scratch[GROUP];
  const accumulator rr = total(partial, 0, scratch), bb = total(partial, 1, scratch);
  if (get_local_id(0) > 0) return;
  scalars += get_group_id(0) * SCALARS;
  scalars[RR] = rr;
  if (with_source) scalars[BB] = bb;
}

// Partial sums of r.z and z, z the preconditioned residual.
kernel void sum_preconditioned(int cells, global const real *restrict r, global const real *restrict z,
                               global accumulator *restrict partial) {
  r += get_global_id(1) * cells;
  z += get_global_id(1) * cells;
  accumulator rz = 0, sum = 0;
  FOR_CHUNK(c, cells) {
    rz += (accumulator)r[c] * z[c];
    sum += z[c];
  }
  store_partial(partial, rz, sum);
}

// beta = (r.z) / (r.z before), 0 at first; mean of z.
kernel void finish_beta(global const accumulator *restrict partial, global accumulator *scalars) {
  local accumulator scratch[GROUP];
  const accumulator rz = total(partial, 0, scratch), sum = total(partial, 1, scratch);
  if (get_local_id(0) > 0) return;
  scalars += get_group_id(0) * SCALARS;
  const accumulator before = scalars[RZ];
  scalars[BETA] = before > 0 ? rz / before : 0;
  scalars[RZ] = rz;
  scalars[MEAN] = sum / max(scalars[CELLS], (accumulator)1);
}

// p = z - mean(z) + beta p_before and q = A p; partial sums of p.q.
kernel void search_direction(int nx, int ny, int nz, global const real *restrict g, CROSS_ARGUMENT
                             global const real *restrict inverse_diagonal, global const real *restrict z,
                             global const real *restrict p_before, global const accumulator *restrict scalars,
                             global real *restrict p, global real *restrict q,
                             global accumulator *restrict partial) {
  const Strides s = strides(nx, ny, nz);
  const int field = get_global_id(1);
  z += field * s.cells;
  p_before += field * s.cells;
  p += field * s.cells;
  q += field * s.cells;
  const real mean = scalars[field * SCALARS + MEAN], beta = scalars[field * SCALARS + BETA];
  const int step[3] = {s.x, s.y, s.z};
  accumulator pq = 0;
  FOR_CHUNK(c, s.cells) {
    if (!(inverse_diagonal[c] > 0)) {
      p[c] = q[c] = 0;
      continue;
    }
    const real zc = z[c], pc = p_before[c];
    real flux = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int lower = c - step[axis], upper = c + step[axis];
      flux += g[axis * s.cells + c] * ((zc - z[lower]) + beta * (pc - p_before[lower])) +
              g[axis * s.cells + upper] * ((zc - z[upper]) + beta * (pc - p_before[upper]));
    }
    real flux_before = 0;
    ADD_CROSS(flux, z, c, s);
    ADD_CROSS(flux_before, p_before, c, s);
    flux += beta * flux_before;
    p[c] = zc - mean + beta * pc;
    q[c] = flux;
    pq += (accumulator)p[c] * flux;
  }
  store_partial(partial, pq, 0);
}

// x += z.
kernel void add_correction(int cells, global const real *restrict inverse_diagonal, global const real *restrict z,
                           global real *restrict x) {
  z += get_global_id(1) * cells;
  x += get_global_id(1) * cells;
  FOR_CHUNK(c, cells) {
    if (inverse_diagonal[c] > 0) x[c] += z[c];
  }
}

// alpha = (r.z) / (p.q); 0 once the residual is nothing.
kernel void finish_alpha(global const accumulator *restrict partial, global accumulator *scalars) {
  local accumulator scratch[GROUP];
  const accumulator pq = total(partial, 0, scratch);
  if (get_local_id(0) > 0) return;
  scalars += get_group_id(0) * SCALARS;
  scalars[ALPHA] = pq > 0 ? scalars[RZ] / pq : 0;
}

// x += alpha p, r -= alpha q; partial sums of r.r.
kernel void update(int cells, global const real *restrict p, global const real *restrict q,
                   global const accumulator *restrict scalars, global real *restrict x, global real *restrict r,
                   global accumulator *restrict partial) {
  const int field = get_global_id(1);
  p += field * cells;
  q += field * cells;
  x += field * cells;
  r += field * cells;
  const real alpha = scalars[field * SCALARS + ALPHA];
  accumulator rr = 0;
  FOR_CHUNK(c, cells) {
    x[c] += alpha * p[c];
    r[c] -= alpha * q[c];
    rr += (accumulator)r[c] * r[c];
  }
  store_partial(partial, rr, 0);
}
