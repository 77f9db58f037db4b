// The member's kernel for prescribed pressures. Needs solid_nodes.cl, solid_cells.cl.

#define FEWEST_STEPS_TO_HALT 5

// A member under prescribed pressures: one work-group (a work-item on CPUs) each. node_blocks, cell_blocks, item_blocks
// (members + 1): first blocks of its nodes, cells and, by cavity, items (members * CAVITIES + 1).
// loads: (ramp ms, end ms, tolerance of the residual, 1 when quasi-static). pressures (members, CAVITIES): kPa.
kernel void solid_load(global const real *restrict partial, global const real *restrict measures,
                       global const real *restrict volume, global const int *restrict node_blocks,
                       global const int *restrict cell_blocks, global const int *restrict item_blocks,
                       global const real *restrict pressures, const real4 loads, global wide *restrict state,
                       const int all_node_blocks, const int all_cell_blocks, const int measured, const real h,
                       const real courant, const int odd) {
#ifdef GPU
  local wide scratch[MEMBER_GROUP];
  const int member = get_group_id(0), item = get_local_id(0);
#else
  local wide *scratch = 0;
  const int member = get_global_id(0), item = 0;
#endif
  global wide *S = state + member * MEMBER_STATE;
  if (S[ENDED] != 0) return;
  const int first = node_blocks[member], last = node_blocks[member + 1];
  const wide kinetic = member_sum(partial + (size_t)KINETIC_SUM * all_node_blocks, first, last, scratch);
  const wide free_force = member_sum(partial + (size_t)FREE_SUM * all_node_blocks, first, last, scratch);
  const wide loaded = member_sum(partial + (size_t)LOADED_SUM * all_node_blocks, first, last, scratch);
  wide volumes[CAVITIES + 1];
  for (int q = 0; q < CAVITIES; ++q)
    volumes[q] = member_sum(volume, item_blocks[member * CAVITIES + q] * SOLID_BLOCK,
                            item_blocks[member * CAVITIES + q + 1] * SOLID_BLOCK, scratch);
  const int first_cell = cell_blocks[member], last_cell = cell_blocks[member + 1];
  real speed2 = 0, collapse = 0;
  wide energy = 0;
  if (measured) {
    speed2 = member_largest(measures + (size_t)SPEED_MEASURE * all_cell_blocks, first_cell, last_cell, scratch);
    collapse = member_largest(measures + (size_t)COLLAPSE_MEASURE * all_cell_blocks, first_cell, last_cell, scratch);
    energy = member_sum(measures + (size_t)ENERGY_MEASURE * all_cell_blocks, first_cell, last_cell, scratch);
  }
  if (item != 0) return;
  const wide time = S[TIME], ramp = loads.x, end = loads.y;
  const bool still = loads.w != 0, full = time >= ramp;
  if (measured) take_measures(S, speed2, collapse, energy, h, courant);
  const wide residual = loaded > 0 ? sqrt(free_force / loaded) : 0;
  S[RESIDUAL] = residual;
  S[HALTED] = S[HALT];  // of the step under way
  S[SINCE_HALT] += 1;
  S[HALT] = still && S[SINCE_HALT] > FEWEST_STEPS_TO_HALT && kinetic < S[KINETIC] ? 1 : 0;
  if (S[HALT] != 0) S[SINCE_HALT] = 0;
  S[KINETIC] = S[HALT] != 0 ? 0 : kinetic;
  if (still && full && residual < loads.z) S[ENDED] = TISSUE_SETTLED;
  if (!isfinite((real)kinetic) || !isfinite((real)free_force)) S[ENDED] = TISSUE_RUNAWAY;
  const wide dt = S[STEP + odd];
  S[TIME] = S[BEAT_TIME] = time + dt;
  S[LOAD] = S[TIME] < ramp ? S[TIME] / ramp : 1;
  for (int q = 0; q < CAVITIES; ++q) {
    S[FIRST_VOLUME + q] = volumes[q];
    S[FIRST_PRESSURE + q] = S[LOAD] * pressures[member * CAVITIES + q];
  }
  S[STEPS_DONE] += 1;
  S[STEP + 1 - odd] = dt > 0 ? fmin(S[LARGEST_STEP], (wide)1.02 * dt) : S[LARGEST_STEP];
  if (S[TIME] >= end && S[ENDED] == 0) S[ENDED] = still ? TISSUE_UNSETTLED : TISSUE_SETTLED;
}
