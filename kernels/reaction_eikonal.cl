// The reaction-eikonal model, RE+ of Neic et al., J. Comput. Phys. 346 (2017) 191, section 2.3: arrival times of an
// eikonal equation (eikonal.cl) trigger the cell model by a short stimulus, in the monodomain equation with its diffusion.
//
// Fronts that curve are slower, fronts that meet, or meet a wall, are faster. To first order in diffusivity over speed^2
// (Colli Franzone & Guerri, Math. Biosci. 113 (1993) 145; Keener, J. Math. Biol. 29 (1991) 629)
//     sqrt(grad T . M grad T) = 1 + div(D grad T),     no flux at the walls,   M = c^2 D with the plane speed c sqrt(D).
//
// Needs segments.clh, stimulus.clh and diffusion.clh, and -D PARAMETERS, PASSIVE_LIFT_ms, REGION_SLOTS, region_slot[] (generated).

#define UNREACHED R(1e9)
#define LATENCIES 2  // of a stimulus in a region: from its start until the front leaves it; until its inside is activated

// speed (2, stride) of every cell from speeds (members, REGION_SLOTS, 2), mm/ms.
kernel void front_speed(global const ushort *restrict member_of, global const uchar *restrict region,
                        global const real *restrict speeds, global real *restrict speed, const int stride) {
  const int i = get_global_id(0), r = region[i];
  const int first = r == NO_REGION ? 0 : 2 * (member_of[i / LANES] * REGION_SLOTS + region_slot[r]);
  speed[i] = r == NO_REGION ? 0 : speeds[first];
  speed[i + (size_t)stride] = r == NO_REGION ? 0 : speeds[first + 1];
}

// Squared length of d in the metric of speeds `along` and `across` fibre f.
inline real squared_time(real3 d, real3 f, real along, real across) {
  const real l = dot(d, f);
  return l * l / (along * along) + fmax(dot(d, d) - l * l, R(0.0)) / (across * across);
}

// Time from the stimulus s (stimulus.clh) to p through tissue with the speeds of p.
inline real time_from(global const real *s, real3 p, real3 f, real along, real across) {
  if (s[5] != 0) {  // a ball: along the radius
    const real3 d = p - (real3)(s[6], s[7], s[8]);
    return sqrt(squared_time(d, f, along, across)) * fmax(1 - s[9] / length(d), R(0.0));
  }
  // A box: the point of it that is nearest in the metric, coordinate by coordinate.
  const real lower[3] = {s[6], s[7], s[8]}, upper[3] = {s[9], s[10], s[11]}, at[3] = {p.x, p.y, p.z};
  const real n[3] = {f.x, f.y, f.z};
  const real slow = 1 / (across * across), less = 1 / (along * along) - slow;
  real d[3];
  for (int a = 0; a < 3; ++a) d[a] = at[a] - clamp(at[a], lower[a], upper[a]);
  for (int pass = 0; pass < 20; ++pass)
    for (int a = 0; a < 3; ++a) {
      real rest = 0;
      for (int b = 0; b < 3; ++b) rest += b == a ? 0 : less * n[a] * n[b] * d[b];
      const real free = -rest / (slow + less * n[a] * n[a]);
      d[a] = at[a] - clamp(at[a] - free, lower[a], upper[a]);
    }
  return sqrt(squared_time((real3)(d[0], d[1], d[2]), f, along, across));
}

// Time from p inside the stimulus s to its surface, where there is tissue beyond that.
inline real time_to_surface(global const real *s, real3 p, real3 f, real along, real across, global const int *place,
                            int member, real4 origin_and_spacing) {
  if (s[5] != 0) {
    const real3 d = p - (real3)(s[6], s[7], s[8]);
    const real r = length(d);
    return r > R(1e-6) * s[9] ? sqrt(squared_time(d, f, along, across)) * fmax(s[9] / r - 1, R(0.0)) : s[9] / fmax(along, across);
  }
  const real at[3] = {p.x, p.y, p.z}, n[3] = {f.x, f.y, f.z}, h = origin_and_spacing.w;
  const real origin[3] = {origin_and_spacing.x, origin_and_spacing.y, origin_and_spacing.z};
  const int extent[3] = {NX, NY, NZ};
  real least = UNREACHED;
  for (int a = 0; a < 3; ++a)
    for (int side = 0; side < 2; ++side) {
      const real face = s[6 + 3 * side + a];
      int beyond[3];
      for (int b = 0; b < 3; ++b) {
        const real x = b != a ? at[b] : side ? fmax(face + R(0.5) * h, at[a] + h) : fmin(face - R(0.5) * h, at[a] - h);
        beyond[b] = clamp((int)floor((x - origin[b]) / h), 0, extent[b] - 1);
      }
      const int cell = beyond[0] + NX * (beyond[1] + NY * (beyond[2] + NZ * member));
      if (place[cell / LANES] == 1) continue;
      const real speed = sqrt(across * across + (along * along - across * across) * n[a] * n[a]);
      least = fmin(least, fabs(face - at[a]) / speed);
    }
  return least;
}

// Where and when stimuli start the front: their cells, and those beside them at the exact distance from their surface.
// latency (members, REGION_SLOTS, STIMULI, LATENCIES) ms, UNREACHED where a stimulus starts nothing.
kernel void front_sources(global const real *restrict stimuli, const real4 origin_and_spacing,
                          global const int *restrict first_cell, global const int *restrict place,
                          global const ushort *restrict member_of, global const uchar *restrict region,
                          global const uchar *restrict stimulated_by, global const real *restrict fibre,
                          global const real *restrict speed, global const real *restrict latency,
                          global real *restrict initial, const int stride, const int grid_cells) {
  const int i = get_global_id(0);
  initial[i] = UNREACHED;
  if (region[i] == NO_REGION) return;
  const int cell = first_cell[i / LANES] + i % LANES, member = member_of[i / LANES];
  const real3 p = cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz, origin_and_spacing.w);
  const real3 f = (real3)(fibre[i], fibre[i + (size_t)stride], fibre[i + 2 * (size_t)stride]);
  int beside = 0;
  for (int k = 0; k < 27; ++k) {
    const int n = clamp(cell + k % 3 - 1 + NX * (k / 3 % 3 - 1 + NY * (k / 9 - 1)), 0, grid_cells - 1);
    beside |= stimulated_by[LANES * place[n / LANES] + n % LANES];
  }
  for (int k = 0; k < STIMULI; ++k) {
    if (!(beside >> k & 1)) continue;
    global const real *s = stimuli + (member * STIMULI + k) * STIMULUS_NUMBERS;
    global const real *l = latency + ((member * REGION_SLOTS + region_slot[region[i]]) * STIMULI + k) * LATENCIES;
    if (!(l[0] < UNREACHED)) continue;
    const real along = speed[i], across = speed[i + (size_t)stride];
    const real start = stimulated_by[i] >> k & 1
                           ? fmax(l[1], l[0] - time_to_surface(s, p, f, along, across, place, member, origin_and_spacing))
                           : l[0] + time_from(s, p, f, along, across);
    initial[i] = fmin(initial[i], s[0] + start);
  }
}

// slowness = 1 + div(D grad T), of cells that the front reaches.
kernel void front_slowness(global const real *restrict T, global const real *restrict stencil,
                           global const real *restrict inverse_capacity, global const int8 *restrict neighbours,
                           global real *restrict slowness, const int stride) {
  const int i = THIS_CELL;
  const Rows rows = neighbour_rows(neighbours, i);
  const realv change = LOAD(inverse_capacity + i) * diffusion(T, stencil, stride, rows, i);
  // Beyond these the expansion does not hold: next to a source, and beside cells that the front does not reach.
  const intv reached = isless(fabs(change), (realv)(1000));
  STORE(1 + WHERE(reached, clamp(change, (realv)(R(-0.5)), (realv)(1)), (realv)(0)), slowness + i);
}

// The trigger: a stimulus that ends when the front arrives, as long as the cell model needs to its threshold.
// trigger (members, REGION_SLOTS, 2): amplitude mV/ms, length ms. Beats: count arrivals, period ms apart.
// A front that arrives before the stimulus could have begun leaves it less time: the same lift, from 0 to the arrival, but
// for what the cell's own currents add or take in that time (PASSIVE_LIFT_ms times the amplitude lifts a cell without any).
// activation: see monodomain.cl; a crossing within this stimulus is recorded here.
kernel void trigger_cells(global real *restrict V, global const real *restrict arrival,
                          global const ushort *restrict member_of, global const uchar *restrict region,
                          global const real *restrict trigger, global const real *restrict parameters,
                          global float *restrict activation, global const real *restrict beats, const real time_whole,
                          const real time_fraction, const real dt, const int stride) {
  const int i = get_global_id(0), r = region[i];
  if (r == NO_REGION || !(arrival[i] < UNREACHED)) return;
  const int member = member_of[i / LANES];
  global const real *t = trigger + 2 * (member * REGION_SLOTS + region_slot[r]);
  const real period = beats[2 * member], count = beats[2 * member + 1];
  if (!(t[1] > 0)) return;  // nothing lifts this cell so far
  const real length = clamp(arrival[i], fmin(dt, t[1]), t[1]);
  const real lift = t[0] * (length < t[1] ? mix((real)PASSIVE_LIFT_ms, t[1], length / t[1]) : t[1]);
  const real first = time_whole - fmax(arrival[i] - length, R(0.0)) + time_fraction;  // since the first beat's stimulus began
  const real beat = period > 0 ? clamp(floor((first + dt) / period), R(0.0), count - 1) : 0;
  const real since = first - beat * period;
  if (since + dt <= 0 || since >= length) return;
  const real before = V[i], after = before + dt * lift / length * pulse_overlap(since, dt, length);
  V[i] = after;
#ifdef ACTIVATION
  const real threshold = parameters[(size_t)member * PARAMETERS + PARAM_electrophysiology_activation_threshold_mV];
  if (before < threshold && after >= threshold) {
    const float when = (float)(time_whole + (time_fraction + dt * (threshold - before) / (after - before)));
    if (activation[i] < 0) activation[i] = when;
#ifdef BEATS
    activation[i + (size_t)stride] = when;
    activation[i + 2 * (size_t)stride] += 1;
#endif
  }
#endif
}
