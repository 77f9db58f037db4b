// Looks at the cells of the time loop, now and then: states that leave what their model declares (gates: [0, 1]), and the charge that diffusion
// moves, whose sum over a member's tissue is nothing. Behind record.cl (sum_of_group, note_first, BLOCK); needs CELL_MODELS, STATES (of the model
// that has most) and the tables lowest_state[], highest_state[] (CELL_MODELS, STATES) from the host.
#if !defined(CELL_MODELS) || !defined(STATES)
#error "cell_checks.cl needs CELL_MODELS and STATES"
#endif

// The first state of cell i that is beyond its bounds, or -1.
inline int state_beyond(global const real *restrict states, global const uchar *restrict model_of, int i, int stride) {
#if CELL_MODELS == 1
  const int model = 0;
#else
  const int model = model_of[i];
#endif
  for (int k = 0; k < STATES; ++k) {
    const real x = states[i + k * (size_t)stride];
    if (!(x >= lowest_state[model * STATES + k] && x <= highest_state[model * STATES + k])) return k;
  }
  return -1;
}

// moved (2, blocks): the sum of the cells' currents (mV/ms times capacity) and of their magnitudes. first (blocks, 2): the number of the look
// that first found a state beyond its bounds, and its cell; what (blocks): which. first stands at -1 before.
kernel void check_cells(global const real *restrict V, global const real *restrict stencil,
                        global const real *restrict inverse_capacity, global const int8 *restrict neighbours,
                        global const real *restrict states, global const uchar *restrict model_of,
                        global real *restrict moved, global int *restrict first, global real *restrict what,
                        const int stride, const int blocks, const int look) {
#ifdef GPU
  local real scratch[BLOCK];
  const int i = THIS_CELL, block = get_group_id(0);
  const real current = diffusion(V, stencil, stride, neighbour_rows(neighbours, i), i);
  const real net = sum_of_group(current, scratch), all = sum_of_group(fabs(current), scratch);
  const int state = inverse_capacity[i] > 0 ? state_beyond(states, model_of, i, stride) : -1;
  const real found = sum_of_group(state >= 0 ? 1 : 0, scratch);
  if (get_local_id(0) == 0) {
    moved[block] = net;
    moved[block + blocks] = all;
  }
  if (found > 0 && first[2 * block] < 0) note_first(state >= 0, look, i, state, scratch, first + 2 * block, what + block);
#else
  const int block = get_global_id(0);
  realv net = 0, all = 0;
  for (int k = 0; k < BLOCK; k += WIDTH) {
    const int i = FIRST_CELL + block * BLOCK + k;
    const realv current = diffusion(V, stencil, stride, neighbour_rows(neighbours, i), i);
    net += current;
    all += fabs(current);
    for (int lane = 0; lane < WIDTH; ++lane) {
      if (!(inverse_capacity[i + lane] > 0)) continue;
      const int state = state_beyond(states, model_of, i + lane, stride);
      if (state < 0 || first[2 * block] >= 0) continue;
      first[2 * block] = look;
      first[2 * block + 1] = i + lane;
      what[block] = state;
    }
  }
  real net_lane[WIDTH], all_lane[WIDTH], net_sum = 0, all_sum = 0;
  STORE(net, net_lane);
  STORE(all, all_lane);
  for (int k = 0; k < WIDTH; ++k) {
    net_sum += net_lane[k];
    all_sum += all_lane[k];
  }
  moved[block] = net_sum;
  moved[block + blocks] = all_sum;
#endif
}

// checks (looks, members, 3) at row `row`: net and absolute sums of each member, and the number of blocks that have a state beyond its bounds.
kernel void check_members(global const real *restrict moved, global const int *restrict first, global const int *restrict first_block,
                          global real *restrict checks, const int blocks) {
#ifdef GPU
  local real scratch[BLOCK];
  const int member = get_group_id(0), lane = get_local_id(0), lanes = BLOCK;
#else
  const int member = get_global_id(0), lane = 0, lanes = 1;
#endif
  real net = 0, all = 0, found = 0;
  for (int block = first_block[member] + lane; block < first_block[member + 1]; block += lanes) {
    net += moved[block];
    all += moved[block + blocks];
    found += first[2 * block] >= 0 ? 1 : 0;
  }
#ifdef GPU
  net = sum_of_group(net, scratch);
  all = sum_of_group(all, scratch);
  found = sum_of_group(found, scratch);
  if (lane == 0)
#endif
  {
    checks[3 * member] = net;
    checks[3 * member + 1] = all;
    checks[3 * member + 2] = found;
  }
}
