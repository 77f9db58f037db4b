// By block of nodes: power that dashpots take, uJ/ms. Needs solid_reduce.clh, solid_nodes.cl, and solid_energy.clh's -D ENERGY.
#if ENERGY
kernel void solid_dashpots(global const wide *restrict state, global const ushort *restrict member_of_node,
                           global const int *restrict support_of, global const real *restrict supports,
                           global const real *restrict v, global real *restrict partial, const int nodes,
                           const int support_stride) {
#ifdef GPU
  local real scratch[SOLID_BLOCK];
  const int a = get_global_id(0), block = get_group_id(0);
#else
  const int block = get_global_id(0);
#endif
  if (state[member_of_node[block] * MEMBER_STATE + ENDED] != 0) return;
  real power = 0;
#ifndef GPU
  for (int a = block * SOLID_BLOCK; a < (block + 1) * SOLID_BLOCK; ++a)
#endif
  {
    const int s = support_of[a];
    if (s >= 0) {
      const real3 velocity = (real3)(v[a], v[a + (size_t)nodes], v[a + 2 * (size_t)nodes]);
      power += dot(velocity, sym_times(support_part(supports, support_place(s), 1, support_stride), velocity));
    }
  }
#ifdef GPU
  sums_of_block(&power, 1, scratch);
  power = scratch[0];
  if (get_local_id(0) == 0)
#endif
    partial[block] = power;
}
#endif
