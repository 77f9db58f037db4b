// Circulation without tissue: the loop over time is inside, since a step is a microsecond and a launch is several. A
// work-item is a member. Behind circulation.clh and beats.clh.

// P (members, PARAMETERS) -> states at their start.
kernel void start_circulation(global const real *parameters, global heart_state *states, global const wide *numbers,
                              const int count) {
  const int m = get_global_id(0);
  if (m >= count) return;
  global const real *P = parameters + m * PARAMETERS;
  const loop_parameters a = load_loop(P, numbers[0]);
  heart_state h;
  for (int i = 0; i < NODES; ++i) {
    h.loop.volume[i] = initial_volume(&a, P, i);
    h.loop.lost[i] = h.loop.pressure[i] = 0;
  }
  for (int e = 0; e < EDGES; ++e) h.loop.flow[e] = initial_flow(P, e);
  begin_heart(&a, &h);
  states[m] = h;
}

#ifdef ALONE  // no chamber is tissue, which the kernels of the solid step
// Up to `steps` steps of every member: of the scene's step in ms times the member's factor. pressure and volume: (members, COMPARTMENTS, samples) in mmHg and mL.
kernel void advance_circulation(global const real *restrict parameters, global heart_state *restrict states,
                                global heart_status *restrict status, global const wide *restrict numbers,
                                global float *restrict pressure, global float *restrict volume, const int at_most,
                                const int samples, const int steps, const int count) {
  const int m = get_global_id(0);
  if (m >= count) return;
  const loop_parameters a = load_loop(parameters + m * PARAMETERS, numbers[0]);
  const heart_clock c = load_clock(numbers, at_most, samples);
  heart_state h = states[m];
  const long row = (long)m * COMPARTMENTS * samples;
  const wide step_ms = numbers[4] * parameters[m * PARAMETERS + STEP_FACTOR];
  for (int k = 0; k < steps && h.ended == RUNNING; ++k)
    advance_heart(&a, &c, &h, 0, step_ms, pressure + row, volume + row);
  states[m] = h;
  status[m] = status_of(&h);
}
#endif
