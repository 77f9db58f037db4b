// ECG without a time loop: V(x, t) = A(t - T(x)), the action potential A of the cell's region behind its arrival time T,
// so that lead(t) = sum over cells of w A(t - T). As in ECGsim (van Oosterom & Oostendorp, J. Electrocardiol. 37 (2004)
// suppl. 168) and Pezzuto et al., Europace 19 (2017) iv56, with templates from the cell model itself.
//
// A table holds the potentials relative to the resting potential of its member's first column, mV. Of a parameter that
// varies within a region there are several columns. A column has PHASES + 1 rows of ROW samples: row p is the potential
// at (j - FOOT) interval + p interval / PHASES after the crossing of the threshold, so that the samples of one cell are
// consecutive numbers of two neighbouring rows. FOOT samples and a whole vector lie before the crossing.
// Needs segments.clh and -D FOOT, PHASES, ROW, SAMPLES (of the series), COLUMNS (of a member), LEADS, BLOCK.
#if !defined(FOOT) || !defined(PHASES) || !defined(ROW) || !defined(COLUMNS) || !defined(SAMPLES)
#error "templates.cl needs FOOT, PHASES, ROW, SAMPLES and COLUMNS"
#endif
#define QUANTITIES (LEADS + 1)  // the leads, and the number of cells whose potential is no number of use
#define LARGEST_POTENTIAL_mV 1000
#define NEVER 0x3fffffff  // sample from which a cell that is not reached would be activated

// Where each tissue cell finds its potential: place (stride), such that table[place + k] is that of sample k, in the
// lower column and phase; start (stride): the first sample within the table; share (2, stride): of the next phase and of
// the next column. column_first, column_count by region (0: none); column_of (stride): place between the
// columns of its region, 0 to 1, where column_count is above 1.
kernel void template_places(global const real *restrict arrival, global const ushort *restrict member_of,
                            global const uchar *restrict tissue_region_of, global const int *restrict column_first,
                            global const int *restrict column_count, global const real *restrict column_of,
                            global int *restrict place, global int *restrict start, global real *restrict share,
                            const int stride, const real interval) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  const int columns = region == NO_REGION ? 0 : column_count[region];
  place[i] = 0;
  start[i] = NEVER;
  share[i] = share[i + (size_t)stride] = 0;
  const real T = arrival[i];
  if (columns == 0 || !(T < SAMPLES * interval)) return;
  const real come = ceil(T / interval), late = (come * interval - T) / interval * PHASES;
  const int phase = clamp((int)late, 0, PHASES - 1), sample = (int)come;
  const real along = columns > 1 ? clamp(column_of[i], R(0.0), R(1.0)) * (columns - 1) : 0;
  const int column = columns > 1 ? min((int)along, columns - 2) : 0;
  start[i] = sample - FOOT;
  place[i] = (((int)member_of[i / LANES] * COLUMNS + column_first[region] + column) * (PHASES + 1) + phase) * ROW +
             FOOT + LANES - sample;
  share[i] = late - phase;
  share[i + (size_t)stride] = along - column;
}

// partial (QUANTITIES, blocks, ROW): sums over each block of cells at WIDTH samples for each work-item; cells in turn.
kernel void project_blocks(global const real *restrict table, global const int *restrict place,
                           global const int *restrict start, global const real *restrict share,
                           global const real *restrict inverse_capacity, global const real *restrict weights,
                           global real *restrict partial, const int stride, const int blocks) {
  const int k = get_global_id(0) * WIDTH, block = get_global_id(1);
  realv total[QUANTITIES];
#pragma unroll
  for (int q = 0; q < QUANTITIES; ++q) total[q] = 0;
  for (int i = FIRST_CELL + block * BLOCK; i < FIRST_CELL + (block + 1) * BLOCK; ++i) {
    if (k + WIDTH <= start[i]) continue;  // at rest, or no tissue
    const real between = share[i], across = share[i + (size_t)stride];
    global const real *low = table + place[i] + k;
    global const real *high = across > 0 ? low + (PHASES + 1) * ROW : low;
    const realv lower = mix(LOAD(low), LOAD(low + ROW), (realv)(between));
    const realv upper = mix(LOAD(high), LOAD(high + ROW), (realv)(between));
    const realv u = mix(lower, upper, (realv)(across));
#pragma unroll
    for (int q = 0; q < LEADS; ++q) total[q] = fma((realv)(weights[i + q * (size_t)stride]), u, total[q]);
    total[LEADS] += WHERE(isless(fabs(u), (realv)(LARGEST_POTENTIAL_mV)), (realv)(0), (realv)(1));
  }
#pragma unroll
  for (int q = 0; q < QUANTITIES; ++q) STORE(total[q], partial + ((size_t)q * blocks + block) * ROW + k);
}

// series (SAMPLES, members, QUANTITIES): each member's blocks in turn.
kernel void project_totals(global const real *restrict partial, global const int *restrict first_block,
                           global real *restrict series, const int blocks, const int members) {
  const int k = get_global_id(0), row = get_global_id(1), member = row / QUANTITIES, q = row % QUANTITIES;
  if (k >= SAMPLES) return;
  real total = 0;
  for (int block = first_block[member]; block < first_block[member + 1]; ++block)
    total += partial[((size_t)q * blocks + block) * ROW + k];
  series[((size_t)k * members + member) * QUANTITIES + q] = total;
}
