// What drives active tensions, by time since activation: a table of the potential or the intracellular calcium of single cells
// (tension_drive.clh). Needs a cell model, template_cell.clh and -D FOOT, ROW (samples of a column, FOOT of them before the
// activation);  -D CALCIUM: intracellular calcium, else the potential.
#if !defined(FOOT) || !defined(ROW)
#error "drive_cells.cl needs FOOT and ROW"
#endif

#ifdef CALCIUM
#define DRIVE(cell) ((cell).state[S_Cai])
#else
#define DRIVE(cell) ((cell).V)
#endif

// parameters (cells, CELL_PARAMETERS); columns, threshold (mV), step_factor, silent (cells); table (columns, ROW): mV or mM, every `spacing` ms, from
// FOOT samples before the crossing of the threshold on. Of `beats` stimuli, `beat` ms apart, the last one's; before that the cell is at rest,
// as its model's file says. silent: 1 where a stimulus does not lift the cell so far.
kernel void run_drives(global const real *restrict parameters, global const int *restrict columns,
                       global const real *restrict threshold, global const real *restrict step_factor, global real *restrict table, global int *restrict silent,
                       const real spacing, const real beat, const int beats, const int cells) {
  const int c = get_global_id(0);
  if (c >= cells) return;
  global real *out = table + (size_t)columns[c] * ROW;
  real p[CELL_PARAMETERS];
  for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = parameters[c * CELL_PARAMETERS + k];
  const int substeps = max(1, (int)ceil(spacing * cell_fastest_rate(p) / (RESOLUTION * step_factor[c])));
  const real dt = spacing / substeps;
  const int steps = max(1, (int)rint(beat / dt));

  Cell cell = at_rest(p, dt), begin = cell;
  real crossing = 0;
  for (int b = 0; b < beats && crossing >= 0; ++b) {
    begin = cell;
    crossing = steps_to_crossing(&cell, threshold[c], dt);
    if (b + 1 == beats || crossing < 0) break;
    cell = begin;
    for (int step = 0; step < steps; ++step)
      cell_step(&cell.V, cell.state, cell.d, dt, stimulus_until(crossing, step));
  }
  silent[c] = crossing < 0;
  // The last beat again, written at every spacing before and after the crossing.
  cell = begin;
  const real rest = DRIVE(cell);
  real before = rest;
  int step = 0;
  for (int n = 0; n < ROW; ++n) {
    const real when = crossing + (n - FOOT) * (real)substeps;  // in steps
    for (; crossing >= 0 && step < when; ++step) {
      before = DRIVE(cell);
      cell_step(&cell.V, cell.state, cell.d, dt, stimulus_until(crossing, step));
    }
    out[n] = step == 0 ? rest : mix(before, (real)DRIVE(cell), 1 - (step - when));
  }
}
