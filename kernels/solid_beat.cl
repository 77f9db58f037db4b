// The member's kernel of a beating heart: the cavities' volumes, the pressures that the circulation gives them, the
// next step. First the cavities are inflated with the loop at rest, then it beats. One work-group (a work-item on CPUs) is
// a member. Needs beats.clh, solid_reduce.clh, solid_nodes.cl, solid_cells.clh and chamber_of_cavity[] from the host.

// cavity_ends (members): behind a member's last block of nodes that touches a cavity. inflation (members, 2 + CAVITIES): duration ms,
// damping 1/ms, pressures kPa. damping (members): 1/ms in beats. sampled: whether solid_predict has summed all, so in the step before each that
// is measured, and in that.
kernel void solid_beat(global const real *restrict parameters, global const real *restrict partial,
                       global const real *restrict speeds, global const real *restrict measures,
                       global const real *restrict dashpots, global const real *restrict volume,
                       global const int *restrict node_blocks, global const int *restrict cell_blocks,
                       global const int *restrict item_blocks, global const int *restrict cavity_ends, global const real *restrict inflation,
                       global const real *restrict damping, global wide *restrict state,
                       global heart_state *restrict hearts, global heart_status *restrict status,
                       global const wide *restrict numbers, global float *restrict pressures,
                       global float *restrict volumes, const int at_most, const int samples, const int all_node_blocks,
                       const int all_cell_blocks, const int sampled, const int measured,
                       const real h, const real courant, const int odd) {
  MEMBER_SCRATCH(scratch, NODE_SUMS);
  const int member = own_member(), item = own_item();
  global wide *S = state + member * MEMBER_STATE;
  if (S[ENDED] != 0) return;
#if WINDOWS
  if (S[WAITS] != 0) {
    if (item == 0) S[STEP + 1 - odd] = 0;
    return;
  }
#endif
  const int first = node_blocks[member], last = node_blocks[member + 1];
  wide sums[NODE_SUMS], mm3[CAVITIES];
  member_sums(partial + (size_t)RATE_SUM * all_node_blocks, NODE_SUMS - RATE_SUM, all_node_blocks, first, cavity_ends[member], scratch,
              sums + RATE_SUM);
  for (int q = 0; q < CAVITIES; ++q)
    mm3[q] = member_sum(volume, item_blocks[member * CAVITIES + q], item_blocks[member * CAVITIES + q + 1], scratch);
  if (sampled) member_sums(partial, RATE_SUM, all_node_blocks, first, last, scratch, sums);
  member_look look = {0, 0, 0, 0, 0};
  if (measured) look = look_at_member(measures, speeds, dashpots, cell_blocks, node_blocks, all_cell_blocks, member, scratch);
  if (item != 0) return;
  if (measured)
    take_measures(S, S[STEP + odd], look.speed2, look.collapse, look.energy, h,
                  courant * parameters[(size_t)member * PARAMETERS + PARAM_mechanics_step_factor]);
  if (!isfinite((real)sums[RATE_SUM]) || (sampled && !isfinite((real)sums[KINETIC_SUM]))) S[ENDED] = TISSUE_RUNAWAY;
  const wide dt = S[STEP + odd];
#if ENERGY
  const wide kinetic = kinetic_now(sums[KINETIC_SUM], S[KINETIC]);
  wide kPa_before[CAVITIES];
  for (int q = 0; q < CAVITIES; ++q) kPa_before[q] = S[FIRST_PRESSURE + q];
#endif
  if (sampled) S[KINETIC] = sums[KINETIC_SUM];
  S[STEP_DAMPING] = S[DAMPING];
  if (S[BEAT_TIME] >= 0 && hearts[member].ended != RUNNING) {  // with the step before, which the tissue has taken
    for (int q = 0; q < CAVITIES; ++q) S[FIRST_VOLUME + q] = mm3[q];
    if (S[ENDED] == 0) S[ENDED] = TISSUE_SETTLED;
    return;
  }
  S[STEPS_DONE] += 1;
  wide next = dt > 0 ? fmin(S[LARGEST_STEP], STEP_GROWTH * dt) : S[LARGEST_STEP];
  const loop_parameters a = load_loop(parameters + (size_t)member * PARAMETERS, numbers[0]);
  const heart_clock c = load_clock(numbers, at_most, samples);
  global const real *filling = inflation + member * (2 + CAVITIES);
  if (S[BEAT_TIME] < 0) {
    advance_time(S, dt);
    const wide duration = filling[0], share = fmin(S[TIME] / (W(0.6) * duration), W(1.));
    for (int q = 0; q < CAVITIES; ++q) S[FIRST_PRESSURE + q] = filling[2 + q] * share * share * (3 - 2 * share);
    S[DAMPING] = filling[1];
    if (S[TIME] >= duration) {
      heart_state begun;
      for (int i = 0; i < NODES; ++i) {
        begun.loop.volume[i] = initial_volume(&a, parameters + (size_t)member * PARAMETERS, i);
        begun.loop.lost[i] = begun.loop.pressure[i] = 0;
      }
      for (int e = 0; e < EDGES; ++e) begun.loop.flow[e] = initial_flow(parameters + (size_t)member * PARAMETERS, e);
      for (int q = 0; q < CAVITIES; ++q) {
        // The volume at the step's end, when the loop begins.
        wide rate = sums[RATE_SUM + q];
        for (int r = 0; r < CAVITIES; ++r) {
          const int low = min(q, r), high = max(q, r);
          rate += dt * S[FIRST_PRESSURE + r] * sums[COMPLIANCE_SUM + low * CAVITIES - low * (low - 1) / 2 + high - low];
        }
        attach_cavity(&begun.loop, chamber_of_cavity[q], mm3[q] + dt * rate, S[FIRST_PRESSURE + q]);
      }
      begin_heart(&a, &begun);
      S[BEAT_TIME] = S[BEAT] = 0;
      S[BEAT_LENGTH] = c.beat;
      S[DAMPING] = damping[member];
      S[LOAD] = 1;
      next = clipped_step(&c, &begun, next);
      hearts[member] = begun;
      status[member] = status_of(&begun);
    }
  } else {
    heart_state heart = hearts[member];
    cavities tissue;
    for (int q = 0; q < CHAMBERS; ++q) {
      tissue.rate[q] = tissue.volume[q] = 0;
      for (int r = 0; r < CHAMBERS; ++r) tissue.compliance[q][r] = 0;
    }
    int place = COMPLIANCE_SUM;
    for (int q = 0; q < CAVITIES; ++q) {
      const int chamber = chamber_of_cavity[q];
      tissue.rate[chamber] = sums[RATE_SUM + q];
      tissue.volume[chamber] = mm3[q];
      for (int r = q; r < CAVITIES; ++r) {
        const int other = chamber_of_cavity[r];
        tissue.compliance[chamber][other] = tissue.compliance[other][chamber] = sums[place++];
      }
    }
    const long row = (long)member * COMPARTMENTS * samples;
    const wide taken = advance_heart(&a, &c, &heart, &tissue, dt, pressures + row, volumes + row);
    advance_time(S, taken);
    for (int q = 0; q < CAVITIES; ++q) S[FIRST_PRESSURE + q] = heart.loop.pressure[chamber_of_cavity[q]] / MMHG_PER_KPA;
#if ENERGY  // of the beat in which the step begins
    balance_step(S, kPa_before, sums + RATE_SUM, dt);
    if (measured) balance_look(S, look.energy + kinetic + sums[SPRING_SUM], look.power + 2 * S[DAMPING] * kinetic, look.active);
#endif
    S[BEAT_TIME] = heart.time;
    S[BEAT] = heart.beat;
    next = heart.ended == RUNNING ? clipped_step(&c, &heart, next) : 0;  // no step behind the last one
    hearts[member] = heart;
    status[member] = status_of(&heart);
  }
  for (int q = 0; q < CAVITIES; ++q) S[FIRST_VOLUME + q] = mm3[q];
#if WINDOWS
  if (S[BEAT_TIME] < 0 || hearts[member].ended == RUNNING) next = wait_at_window(S, dt, next);
#endif
  S[STEP + 1 - odd] = next;
}
