// Action potentials of single cells for the table of templates.cl. Needs one cell model with its macros, and
// -D FOOT, PHASES, ROW, LANES.
#if !defined(FOOT) || !defined(PHASES) || !defined(ROW) || !defined(CELL_PARAMETERS)
#error "template_cells.cl needs FOOT, PHASES, ROW and a cell model"
#endif
#define RESOLUTION R(0.2)        // of the model's fastest rate, as in the time loop (solver/time_steps.cpp)
#define LONGEST_STIMULUS_ms 20
#define STIMULUS_mV_per_ms R(35.714)

typedef struct {
  realv V, state[CELL_STATES], d[CELL_DERIVED];
} Cell;

inline Cell at_rest(const real *p, real dt) {
  const real initial[CELL_STATES] = INITIAL_STATES;
  real d[CELL_DERIVED];
  Cell cell;
  cell_derive(p, dt, d);
  for (int k = 0; k < CELL_DERIVED; ++k) cell.d[k] = d[k];
  for (int k = 0; k < CELL_STATES; ++k) cell.state[k] = initial[k];
  cell.V = p[REST];
  return cell;
}

// parameters (columns, CELL_PARAMETERS); columns (columns): column of the table; threshold (columns), reference (columns)
// mV. A stimulus lifts the cell from rest to the threshold and ends there; time 0 of the column is the crossing. A cell
// that it does not lift so far is silent (columns) 1: its column is no number, but for the rest in front.
kernel void run_templates(global const real *restrict parameters, global const int *restrict columns,
                          global const real *restrict threshold, global const real *restrict reference,
                          global real *restrict table, global int *restrict silent, const real interval,
                          const int cells) {
  const int c = get_global_id(0);
  if (c >= cells) return;
  global real *out = table + (size_t)columns[c] * (PHASES + 1) * ROW;
  real p[CELL_PARAMETERS];
  for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = parameters[c * CELL_PARAMETERS + k];
  const real spacing = interval / PHASES;
  const int substeps = max(1, (int)ceil(spacing * cell_fastest_rate(p) / RESOLUTION));
  const real dt = spacing / substeps;

  // The crossing, in steps.
  Cell cell = at_rest(p, dt);
  real crossing = 0;
  bool crossed = false;
  for (int step = 0; step * dt < LONGEST_STIMULUS_ms && !crossed; ++step) {
    const real before = cell.V;
    cell_step(&cell.V, cell.state, cell.d, dt, STIMULUS_mV_per_ms);
    crossed = before < threshold[c] && cell.V >= threshold[c];
    if (crossed) crossing = step + (threshold[c] - before) / (cell.V - before);
  }

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
      cell_step(&cell.V, cell.state, cell.d, dt, step < crossing ? STIMULUS_mV_per_ms * fmin(R(1.0), crossing - step) : 0);
    }
    const real u = step == 0 ? rest : mix(before, (real)cell.V, 1 - (step - when)) - reference[c];
    out[(n % PHASES) * ROW + n / PHASES] = u;
    if (n % PHASES == 0 && n > 0) out[PHASES * ROW + n / PHASES - 1] = u;
  }
  out[PHASES * ROW + ROW - 1] = cell.V - reference[c];
}
