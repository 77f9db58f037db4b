// Cells by themselves, each with its own parameters, under its own pacing: long trains at the cost of the cells alone, since
// the loop over time is inside. A work-item is WIDTH cells. Needs a cell model and
// -D CELL_PARAMETERS, CELL_DERIVED, CELL_STATES, INITIAL_STATES, REST (generated; solver/cell_model).
#if !defined(CELL_PARAMETERS) || !defined(CELL_DERIVED) || !defined(CELL_STATES)
#error "single_cells.cl needs CELL_PARAMETERS, CELL_DERIVED and CELL_STATES"
#endif

// parameters (cells, CELL_PARAMETERS) -> derived (CELL_DERIVED, cells) for steps of dt ms, fastest_rate (cells) in 1/ms.
kernel void derive_single(global const real *restrict parameters, global real *restrict derived,
                          global real *restrict fastest_rate, const real dt, const int cells) {
  const int i = get_global_id(0);
  if (i >= cells) return;
  real p[CELL_PARAMETERS], d[CELL_DERIVED];
  for (int k = 0; k < CELL_PARAMETERS; ++k) p[k] = parameters[i * CELL_PARAMETERS + k];
  cell_derive(p, dt, d);
  for (int k = 0; k < CELL_DERIVED; ++k) derived[k * cells + i] = d[k];
  fastest_rate[i] = cell_fastest_rate(p);
}

// Initial V (cells) and states (CELL_STATES, cells).
kernel void initialise_single(global const real *restrict parameters, global real *restrict V,
                              global real *restrict states, const int cells) {
  const int i = get_global_id(0);
  if (i >= cells) return;
  const real initial[CELL_STATES] = INITIAL_STATES;
  V[i] = parameters[i * CELL_PARAMETERS + REST];
  for (int k = 0; k < CELL_STATES; ++k) states[k * cells + i] = initial[k];
}

// `steps` steps of dt ms. protocol (3, cells), in steps: period, number of pulses, interval from the last of these to one
// pulse more (0: none). A pulse lasts `pulse_steps` with `amplitude` mV/ms; the first starts at once.
// trace (1 + steps / sample_steps, 1 + recorded, cells): V and the states numbered in record_state, at the start and at every sample.
kernel void pace_cells(global const real *restrict derived, global real *restrict V, global real *restrict states,
                       global const real *restrict protocol, global real *restrict trace,
                       global const int *restrict record_state, const int recorded, const int cells, const int steps,
                       const int sample_steps, const int pulse_steps, const real amplitude, const real dt, const int vectors) {
  const int item = get_global_id(0), i = item * WIDTH;
  if (item >= vectors) return;
  realv d[CELL_DERIVED], state[CELL_STATES];
  for (int k = 0; k < CELL_DERIVED; ++k) d[k] = LOAD(derived + k * cells + i);
  for (int k = 0; k < CELL_STATES; ++k) state[k] = LOAD(states + k * cells + i);
  realv u = LOAD(V + i);
  const realv period = LOAD(protocol + i), pulses = LOAD(protocol + cells + i), extra = LOAD(protocol + 2 * cells + i);
  const realv length = pulse_steps, on = amplitude;
  realv phase = 0, pulse = 1;  // steps since the start of the pulse with this number
  for (int step = 0; step <= steps; ++step) {
    if (step % sample_steps == 0) {
      global real *row = trace + (size_t)(step / sample_steps) * (1 + recorded) * cells + i;
      STORE(u, row);
      for (int k = 0; k < CELL_STATES; ++k) STORE(state[k], states + k * cells + i);
      for (int k = 0; k < recorded; ++k) STORE(LOAD(states + record_state[k] * cells + i), row + (1 + k) * cells);
    }
    if (step == steps) break;
    const intv next = isgreaterequal(phase, period) & isless(pulse, pulses);
    phase = WHERE(next, (realv)(0), phase);
    pulse = WHERE(next, pulse + 1, pulse);
    const intv last = isgreaterequal(pulse, pulses) & isgreater(extra, (realv)(0));
    const intv late = last & isgreaterequal(phase, extra) & isless(phase, extra + length);
    const realv stimulus = WHERE(isless(phase, length) | late, on, (realv)(0));
    cell_step(&u, state, d, dt, stimulus);
    phase += 1;
  }
  STORE(u, V + i);
  for (int k = 0; k < CELL_STATES; ++k) STORE(state[k], states + k * cells + i);
}
