// Needs segments.clh, sum_of_group.clh and -D LEADS, BLOCK.

// Sums of the weights of each lead and of their magnitudes, (2, LEADS, blocks): a potential that is the same everywhere gives no ECG.
kernel void check_weights(global const real *restrict weights, global real *restrict sums, const int stride, const int blocks) {
#if LEADS > 0
#ifdef GPU
  local real scratch[BLOCK];
  const int i = THIS_CELL, block = get_group_id(0);
  for (int q = 0; q < LEADS; ++q) {
    const real w = weights[i + q * (size_t)stride];
    const real net = sum_of_group(w, scratch), all = sum_of_group(fabs(w), scratch);
    if (get_local_id(0) != 0) continue;
    sums[block + q * blocks] = net;
    sums[block + (LEADS + q) * blocks] = all;
  }
#else
  const int block = get_global_id(0);
  for (int q = 0; q < LEADS; ++q) {
    real net = 0, all = 0;
    for (int i = FIRST_CELL + block * BLOCK; i < FIRST_CELL + (block + 1) * BLOCK; ++i) {
      net += weights[i + q * (size_t)stride];
      all += fabs(weights[i + q * (size_t)stride]);
    }
    sums[block + q * blocks] = net;
    sums[block + (LEADS + q) * blocks] = all;
  }
#endif
#endif
}
