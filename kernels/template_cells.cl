// Action potentials of single cells for the table of templates.cl. Needs one cell model with its macros, template_cell.clh,
// and -D FOOT, PHASES, ROW, LANES.
#if !defined(FOOT) || !defined(PHASES) || !defined(ROW) || !defined(CELL_PARAMETERS)
#error "template_cells.cl needs FOOT, PHASES, ROW and a cell model"
#endif

// parameters (columns, CELL_PARAMETERS); columns (columns): column of the table; threshold (columns), reference (columns)
// mV; step_factor (columns). A stimulus lifts the cell from rest to the threshold and ends there; time 0 of the column is the crossing. A cell
// that it does not lift so far is silent (columns) 1: its column is no number, but for the rest in front.
kernel void run_templates(global const real *restrict parameters, global const int *restrict columns,
                          global const real *restrict threshold, global const real *restrict reference,
                          global const real *restrict step_factor, global real *restrict table, global int *restrict silent, const real interval,
                          const int cells) {
  const int c = get_global_id(0);
  if (c >= cells) return;
  global real *out = table + (size_t)columns[c] * (PHASES + 1) * ROW;
  real p[CELL_PARAMETERS];
  for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = parameters[c * CELL_PARAMETERS + k];
  const real spacing = interval / PHASES;
  const int substeps = max(1, (int)ceil(spacing * cell_fastest_rate(p) / (RESOLUTION * step_factor[c])));
  const real dt = spacing / substeps;

  Cell cell = at_rest(p, dt);
  const real crossing = steps_to_crossing(&cell, threshold[c], dt);
  const bool crossed = crossing >= 0;
  silent[c] = !crossed && isless(fabs((real)cell.V), R(1000.0));  // else unstable, which the samples tell
  if (!crossed) {
    for (int n = 0; n < (PHASES + 1) * ROW; ++n) out[n] = NAN;
    out[0] = p[REST] - reference[c];
    return;
  }

  // Again, written at every spacing before and after it.
  cell = at_rest(p, dt);
  const real rest = cell.V - reference[c];
  real before = cell.V;
  int step = 0;
  for (int n = 0; n < ROW * PHASES; ++n) {
    const real when = crossing + (n - (FOOT + LANES) * PHASES) * (real)substeps;  // in steps
    for (; step < when; ++step) {
      before = cell.V;
      cell_step(&cell.V, cell.state, cell.d, dt, stimulus_until(crossing, step));
    }
    const real u = step == 0 ? rest : mix(before, (real)cell.V, 1 - (step - when)) - reference[c];
    out[(n % PHASES) * ROW + n / PHASES] = u;
    if (n % PHASES == 0 && n > 0) out[PHASES * ROW + n / PHASES - 1] = u;
  }
  out[PHASES * ROW + ROW - 1] = cell.V - reference[c];
}
