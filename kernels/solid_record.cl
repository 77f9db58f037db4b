// Displacement of material points, sampled on the device after every step, on straight lines between a step's ends.
// Needs solid.clh.

// A work-item is one component of one point: row (members, points, 3). node, weight (members, points, 8): interpolation at the point.
// before (rows, 2): time (ms; negative: none yet) and value (mm) after the step before. next (rows): sample; -1 at the end.
// series (rows, samples): mm, every `interval` ms of a member's time; with `at_rest` one sample, once it rests. each_beat: of the time of a beat,
// which is written over the one before.
kernel void solid_record(global const wide *restrict state, global const int *restrict node,
                         global const real *restrict weight, global const real *restrict u,
                         global wide *restrict before, global int *restrict next, global float *restrict series,
                         const int nodes, const int points, const int samples, const real interval,
                         const int at_rest, const int each_beat) {
  const int row = get_global_id(0), point = row / 3;
  global const wide *S = state + point / points * MEMBER_STATE;
  if (next[row] < 0 || S[BEAT_TIME] < 0) return;
  wide value = 0;
  for (int c = 0; c < 8; ++c) value += weight[8 * point + c] * u[node[8 * point + c] + (size_t)(row % 3) * nodes];
  global float *own = series + (size_t)row * samples;
  if (at_rest) {
    if (S[ENDED] == TISSUE_SETTLED) own[0] = (float)value;
    if (S[ENDED] != 0) next[row] = -1;
    return;
  }
  if (S[ENDED] != 0) {  // the last step has been sampled
    next[row] = -1;
    return;
  }
  const wide now = each_beat ? S[BEAT_TIME] : S[BEAT] * S[BEAT_LENGTH] + S[BEAT_TIME];
  const wide begin = before[2 * row], first = before[2 * row + 1];
  before[2 * row] = now;
  before[2 * row + 1] = value;
  if (begin < 0) return;
  const bool over = now < begin;  // a beat ended with the step
  const wide length = (over ? S[BEAT_LENGTH] : now) - begin;
  int k = next[row];
  for (; k < samples; ++k) {
    const wide share = length > 0 ? (k * (wide)interval - begin) / length : 1;
    if (!(share < 1 - (wide)1e-6f)) break;
    own[k] = (float)(first + fmin(share, (wide)1) * (value - first));
  }
  next[row] = over ? 0 : k;
}
