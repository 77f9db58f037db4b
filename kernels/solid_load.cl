// The member's kernel for prescribed pressures. Needs solid_nodes.cl, solid_cells.clh, and from the host
//   DRIVEN_CAVITIES         whether a cavity's pressure follows the equation of the active tension (bestel_pressure_step)
//   driven_cavity[]         which
//   MATERIAL_OF_SCENE       place of the block M that holds the equation's numbers

#define FEWEST_STEPS_TO_HALT 5

// Samples of cavities on the stretch of `length` ms that ends at `time`, straight between its ends. last: nothing follows; what is
// left takes the end's values. series (2, CAVITIES, samples) of the member.
inline void take_cavity_samples(global wide *S, const wide *volumes, wide time, wide length, wide interval, bool last, int samples,
                                global float *series) {
  int k = (int)S[NEXT_SAMPLE];
  for (; k < samples; ++k) {
    const wide share = length > 0 ? 1 + (k * interval - time) / length : 1;
    if (!last && !(share < 1 - (wide)1e-6f)) break;
    for (int q = 0; q < CAVITIES; ++q) {
      const wide part = fmin(share, (wide)1);
      const wide kPa = S[LAST_PRESSURE + q] + part * (S[FIRST_PRESSURE + q] - S[LAST_PRESSURE + q]);
      const wide mm3 = S[FIRST_VOLUME + q] + part * (volumes[q] - S[FIRST_VOLUME + q]);
      series[q * samples + k] = (float)(kPa * MMHG_PER_KPA);
      series[(CAVITIES + q) * samples + k] = (float)(mm3 / 1000);
    }
  }
  S[NEXT_SAMPLE] = k;
}

// A member under prescribed pressures: one work-group (a work-item on CPUs) each. node_blocks, cell_blocks, item_blocks
// (members + 1): first blocks of its nodes, cells and, by cavity, items (members * CAVITIES + 1).
// loads: (ramp ms, end ms, tolerance of the residual, 1 when quasi-static). pressures (members, CAVITIES): kPa, of cavities
// that are not driven. series (members, 2, CAVITIES, samples): pressures (mmHg) and volumes (mL), every `interval` ms; of what
// is quasi-static one sample, at rest.
kernel void solid_load(global const real *restrict parameters, global const real *restrict partial, global const real *restrict speeds, global const real *restrict measures,
                       global const real *restrict dashpots,
                       global const real *restrict volume, global const real *restrict pulls, global const int *restrict node_blocks,
                       global const int *restrict cell_blocks, global const int *restrict item_blocks,
                       global const real *restrict pressures, const real4 loads, global wide *restrict state,
                       global float *restrict series, const int samples, const real interval, const int all_node_blocks, const int all_cell_blocks, const int measured, const real h,
                       const real courant, const int odd) {
#if ENERGY
  MEMBER_SCRATCH(scratch, NODE_SUMS);
#else
  MEMBER_SCRATCH(scratch, 1);
#endif
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
  const wide kinetic = member_sum(partial + (size_t)KINETIC_SUM * all_node_blocks, first, last, scratch);
  const wide free_force = member_sum(partial + (size_t)FREE_SUM * all_node_blocks, first, last, scratch);
  wide pressed = 0;
  for (int q = 0; q < CAVITIES; ++q) pressed += fabs(S[FIRST_PRESSURE + q]);
  // Without pressures over what cells pull with.
  const wide loaded = pressed > 0 ? member_sum(partial + (size_t)LOADED_SUM * all_node_blocks, first, last, scratch)
                                  : member_sum(pulls, cell_blocks[member], cell_blocks[member + 1], scratch);
  wide volumes[CAVITIES + 1];
  for (int q = 0; q < CAVITIES; ++q)
    volumes[q] = member_sum(volume, item_blocks[member * CAVITIES + q], item_blocks[member * CAVITIES + q + 1], scratch);
  member_look look = {0, 0, 0, 0, 0};
  if (measured) look = look_at_member(measures, speeds, dashpots, cell_blocks, node_blocks, all_cell_blocks, member, scratch);
#if ENERGY
  wide rates[NODE_SUMS - RATE_SUM + 1];
  member_sums(partial + (size_t)RATE_SUM * all_node_blocks, NODE_SUMS - RATE_SUM, all_node_blocks, first, last, scratch, rates);
  const wide springs = member_sum(partial + (size_t)SPRING_SUM * all_node_blocks, first, last, scratch);
#endif
#ifdef GPU
  barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);  // all have read what the first one writes
#endif
  if (item != 0) return;
#if ENERGY
  const wide kinetic_of_look = kinetic_now(kinetic, S[KINETIC]);
#endif
  const wide time = S[TIME], ramp = loads.x, end = loads.y;
  const bool still = loads.w != 0, full = time >= ramp;
  if (measured)  // what comes to rest is judged by its residual, whichever steps lead there
    take_measures(S, still ? 0 : S[STEP + odd], look.speed2, look.collapse, look.energy, h,
                  courant * parameters[(size_t)member * PARAMETERS + PARAM_mechanics_step_factor]);
  const wide residual = loaded > 0 ? sqrt(free_force / loaded) : 0;
  S[RESIDUAL] = residual;
  S[HALTED] = S[HALT];  // of the step under way
  S[SINCE_HALT] += 1;
  // A halt comes two steps behind the peak of the kinetic energy, and takes nothing from a mode that then turns back. With a fixed number of
  // steps, or a short pattern of them, the same fast mode can do so at every halt, for ever: 0 to 15 more, without order (Knuth's multiplicative hash).
  const int fewest = FEWEST_STEPS_TO_HALT + (int)((uint)S[STEPS_DONE] * 2654435769u >> 28);
  S[HALT] = still && S[SINCE_HALT] > fewest && kinetic < S[KINETIC] ? 1 : 0;
  if (S[HALT] != 0) S[SINCE_HALT] = 0;
  S[KINETIC] = S[HALT] != 0 ? 0 : kinetic;
  if (S[ENDED] == 0 && still && full && S[STEP + odd] > 0 && residual < loads.z) S[ENDED] = TISSUE_SETTLED;
  if (!isfinite((real)kinetic) || !isfinite((real)free_force)) S[ENDED] = TISSUE_RUNAWAY;
  const wide dt = S[STEP + odd];
#if ENERGY
  wide kPa_before[CAVITIES + 1];
  for (int q = 0; q < CAVITIES; ++q) kPa_before[q] = S[FIRST_PRESSURE + q];
#endif
  if (time >= end && S[ENDED] == 0) S[ENDED] = still ? TISSUE_UNSETTLED : TISSUE_SETTLED;
  const bool settled = S[ENDED] == TISSUE_SETTLED;
  global float *own_series = series + (size_t)member * 2 * CAVITIES * samples;
  if (!still || settled)
    take_cavity_samples(S, volumes, time, still ? 0 : S[STEP + 1 - odd], interval, settled, samples, own_series);
  S[STEP_DAMPING] = S[DAMPING];
  if (settled) {
    for (int q = 0; q < CAVITIES; ++q) S[FIRST_VOLUME + q] = volumes[q];
    return;
  }
  advance_time(S, dt);
  S[BEAT_TIME] = S[TIME];
  S[LOAD] = S[TIME] < ramp ? S[TIME] / ramp : 1;
  for (int q = 0; q < CAVITIES; ++q) {
    S[LAST_PRESSURE + q] = S[FIRST_PRESSURE + q];
#if DRIVEN_CAVITIES
    if (driven_cavity[q]) {
      S[FIRST_PRESSURE + q] = bestel_pressure_step(S[FIRST_PRESSURE + q], S[TIME], dt,
                                                   parameters + (size_t)member * PARAMETERS + MATERIAL_OF_SCENE);
      continue;
    }
#endif
    S[FIRST_PRESSURE + q] = S[LOAD] * pressures[member * CAVITIES + q];
  }
#if ENERGY
  balance_step(S, kPa_before, rates, dt);
  if (measured) balance_look(S, look.energy + kinetic_of_look + springs, look.power + 2 * S[DAMPING] * kinetic_of_look, look.active);
#endif
  for (int q = 0; q < CAVITIES; ++q) S[FIRST_VOLUME + q] = volumes[q];
  S[STEPS_DONE] += 1;
  S[STEP + 1 - odd] = dt > 0 ? fmin(S[LARGEST_STEP], STEP_GROWTH * dt) : S[LARGEST_STEP];
#if WINDOWS
  S[STEP + 1 - odd] = wait_at_window(S, dt, S[STEP + 1 - odd]);
#endif
}
