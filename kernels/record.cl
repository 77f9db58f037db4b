// Sums over tissue in a fixed order: blocks of cells, then the blocks of a member. Members never share a block.
// GPUs reduce a block by a work-group, CPUs by a loop of one work-item. Needs segments.clh, diffusion.clh and
// -D LEADS (0 without weights), BLOCK (cells of a block), ROW (quantities of a row of the series, LEADS + 1 unless given:
// ours stand at its end).
#ifndef LEADS
#error "record.cl needs LEADS"
#endif
#ifndef BLOCK
#error "record.cl needs BLOCK"
#endif
#define QUANTITIES (LEADS + 1)  // the leads, and the number of cells whose potential is no number of use
#ifndef ROW
#define ROW QUANTITIES
#endif

// Leads of the potential V + dt_half div(D grad V), the half step that closes the splitting; V itself stays.
// weights (LEADS, stride); partial (QUANTITIES, blocks). bounds (members, 2): mV, between which a potential is of use; wild (blocks, 2) and
// wild_mV (blocks): the first sample at which the block has a potential beyond them, the first such cell, and what it is. wild stands at -1 before.
kernel void record_blocks(global const real *restrict V, global const real *restrict stencil,
                          global const real *restrict inverse_capacity, global const int8 *restrict neighbours,
                          global const real *restrict weights, global const ushort *restrict member_of,
                          global const real *restrict bounds, global real *restrict partial, global int *restrict wild,
                          global real *restrict wild_mV, const int stride, const int blocks, const int sample,
                          const real dt_half) {
#ifdef GPU
  local real scratch[BLOCK];
  const int i = THIS_CELL, block = get_group_id(0);
  const Rows rows = neighbour_rows(neighbours, i);
  const real inverse = inverse_capacity[i];
  const real u = fma(dt_half * inverse, diffusion(V, stencil, stride, rows, i), V[i]);
  const int member = member_of[i / LANES];
  const bool beyond = inverse > 0 && !(u > bounds[2 * member] && u < bounds[2 * member + 1]);
  for (int q = 0; q < QUANTITIES; ++q) {
    const real share = q == LEADS ? (beyond ? 1 : 0) : inverse > 0 ? weights[i + q * (size_t)stride] * u : 0;
    const real total = sum_of_group(share, scratch);
    if (get_local_id(0) == 0) partial[block + q * blocks] = total;
    if (q == LEADS && total > 0 && wild[2 * block] < 0) note_first(beyond, sample, i, u, scratch, wild + 2 * block, wild_mV + block);
  }
#else
  const int block = get_global_id(0), member = member_of[FIRST_CELL / LANES + block * (BLOCK / LANES)];
  const real low = bounds[2 * member], high = bounds[2 * member + 1];
  realv total[QUANTITIES];
#pragma unroll
  for (int q = 0; q < QUANTITIES; ++q) total[q] = 0;
  for (int k = 0; k < BLOCK; k += WIDTH) {
    const int i = FIRST_CELL + block * BLOCK + k;
    const Rows rows = neighbour_rows(neighbours, i);
    const realv inverse = LOAD(inverse_capacity + i);
    const intv tissue = isgreater(inverse, (realv)(0));
    realv u = fma(dt_half * inverse, diffusion(V, stencil, stride, rows, i), LOAD(V + i));
    u = WHERE(tissue, u, (realv)(0));
#pragma unroll
    for (int q = 0; q < LEADS; ++q) total[q] = fma(LOAD(weights + i + q * (size_t)stride), u, total[q]);
    const intv beyond = tissue & !(isgreater(u, (realv)(low)) & isless(u, (realv)(high)));
    total[LEADS] += WHERE(beyond, (realv)(1), (realv)(0));
    if (ANY(beyond) && wild[2 * block] < 0) {
      int k_first = 0;
      while (((const REAL_INT *)&beyond)[k_first] == 0) ++k_first;
      wild[2 * block] = sample;
      wild[2 * block + 1] = i + k_first;
      wild_mV[block] = LANE(u, k_first);
    }
  }
#pragma unroll
  for (int q = 0; q < QUANTITIES; ++q) {
    real lane[WIDTH], sum = 0;
    STORE(total[q], lane);
    for (int k = 0; k < WIDTH; ++k) sum += lane[k];
    partial[block + q * blocks] = sum;
  }
#endif
}

// series (samples, members, ROW) at row `sample`: sums of each member's blocks, from first_block[member] up to
// first_block[member + 1].
kernel void record_totals(global const real *restrict partial, global const int *restrict first_block,
                          global real *restrict series, const int blocks, const int members, const int sample) {
#ifdef GPU
  local real scratch[BLOCK];
  const int row = get_group_id(0), lane = get_local_id(0), lanes = BLOCK;
#else
  const int row = get_global_id(0), lane = 0, lanes = 1;
#endif
  const int member = row / QUANTITIES, q = row % QUANTITIES;
  real total = 0;
  for (int block = first_block[member] + lane; block < first_block[member + 1]; block += lanes)
    total += partial[block + q * blocks];
#ifdef GPU
  total = sum_of_group(total, scratch);
  if (lane == 0)
#endif
    series[((size_t)sample * members + member) * ROW + ROW - QUANTITIES + q] = total;
}
