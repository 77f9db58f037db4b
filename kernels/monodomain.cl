// The monodomain equation dV/dt = div(D grad V) / 1 - I_ion / C_m + I_stim on the compact tissue, diffusion and reaction
// split symmetrically (Strang 1968): half a diffusion step, then reaction and diffusion steps in turn. A diffusion step is
// the explicit midpoint rule, V + dt L (V + dt/2 L V), so that the whole is second order in dt. (Explicit Euler has the same
// limit and costs half the launches, but its fronts are too fast: 1.6 % at dt 0.01 ms and 4 % at 0.02 ms with ten
// Tusscher-Panfilov cells.) One launch is the second stage of a diffusion step followed by a reaction step; the half step that
// closes the scheme at a sample is in record.cl and leaves the state as it is, so that sampling does not change the solution.
//
// Needs segments.clh, diffusion.clh, the cell models with reaction.clh behind each, and
// -D MEMBERS (in the batch), CELL_MODELS, EACH_CELL_MODEL (generated), DERIVED_CONSTANTS and DERIVED_BY_VALUE (see there);
// -D STRETCH_ACTIVATED: with the current of channels that stretch opens, I_sac / C_m = rate (V - E), rate = g (lambda - 1) /
//    (lambda_max - 1) of fibres that are longer than at rest (Niederer & Smith 2007, Prog. Biophys. Mol. Biol. 93:90, review such
//    currents; electromechanics.cl), taken exactly for half a step on either side of the reaction;
// -D STRANG: unless the splitting is Godunov's;
// -D STIMULATED: with stimuli (stimulus.clh);  -D ACTIVATION: records activation times;  -D BEATS: and later ones.
#if !defined(EACH_CELL_MODEL) || !defined(CELL_MODELS) || !defined(MEMBERS)
#error "monodomain.cl needs cell models and MEMBERS"
#endif

#if MEMBERS == 1
#define MEMBER(member_of, i) 0
#else
#define MEMBER(member_of, i) member_of[(i) / LANES]
#endif

// One reaction step for V (mV) of the cells from i on and their states. Of several models, work-items of one cell
// branch by its model; vectors take each model that occurs in them in turn. model_of: see cell_setup.cl.
inline __attribute__((always_inline)) void react(realv *V, global real *restrict states, const Derived derived,
                  global const real *restrict derived_fields, global const uchar *restrict model_of,
                  global const real *restrict parameters, int i, int member, int stride, real dt, realv stimulus) {
#if CELL_MODELS == 1
  react_0(V, states, derived, derived_fields, i, member, stride, dt, stimulus);
#elif WIDTH == 1
#define REACT(k) \
  case k: react_##k(V, states, derived, derived_fields, i, member, stride, dt, stimulus); break;
  switch (model_of[i]) {
    EACH_CELL_MODEL(REACT)
    default: break;
  }
#else
  const intv model = JOIN(convert_, JOIN(REAL_INT, WIDTH))(JOIN(vload, WIDTH)(0, model_of + i));
  global const real *P = parameters + (size_t)member * PARAMETERS;
#define REACT(k)                                                                                              \
  if (ANY(model == (intv)(k)))                                                                                \
    react_##k(V, states, derived, derived_fields, i, member, stride, dt, stimulus, model == (intv)(k), P);
  EACH_CELL_MODEL(REACT)
#endif
}

// V_new = V + dt_diffusion L V_stage after the reaction over dt, all mV and ms; the step begins at time_whole + time_fraction
// (see stimulus.clh). V_before: potential at the start of the step, V itself unless diffusion substeps came between.
// states (states of the model that has most, stride). activation: time of the first upward crossing of the threshold, -1 before
// it; with BEATS (3, stride): behind it the time of the latest crossing and the number of them.
kernel void monodomain_step(global const real *V_stage, global const real *V, global const real *V_before,
                            global real *restrict V_new, global real *restrict states,
                            global const real *restrict stencil, global const real *restrict inverse_capacity,
                            global const int8 *restrict neighbours, global const ushort *restrict member_of,
                            const Derived derived, global const real *restrict derived_fields,
                            global const uchar *restrict model_of, global float *restrict activation,
                            global const uchar *restrict stimulated_by,
                            global const real *restrict stimuli, global const real *restrict parameters,
                            global const real *restrict stretch_rate, const int stride, const real dt_diffusion,
                            const real dt, const real time_whole, const real time_fraction) {
  const int i = THIS_CELL;
  const int member = MEMBER(member_of, i);
  const Rows rows = neighbour_rows(neighbours, i);
  const realv V_old = LOAD(V + i), inverse = LOAD(inverse_capacity + i);
  realv u = fma(dt_diffusion * inverse, diffusion(V_stage, stencil, stride, rows, i), V_old);

#if defined(ACTIVATION) && defined(STRANG)
  const realv diffused = u;
#endif

#ifdef STIMULATED
  const realv stimulus = stimulus_mV_per_ms(stimulated_by + i, stimuli + member * STIMULI * STIMULUS_NUMBERS, time_whole, time_fraction, dt);
#else
  const realv stimulus = 0;
#endif
#ifdef STRETCH_ACTIVATED
  const real reversal = parameters[(size_t)member * PARAMETERS + PARAM_electrophysiology_stretch_activated_reversal_mV];
  const realv opened = expm1(R(-0.5) * dt * LOAD(stretch_rate + i));
  u = fma(opened, u - reversal, u);
#endif
  react(&u, states, derived, derived_fields, model_of, parameters, i, member, stride, dt, stimulus);
#ifdef STRETCH_ACTIVATED
  u = fma(opened, u - reversal, u);
#endif

  u = WHERE(isgreater(inverse, (realv)(0)), u, V_old);
  STORE(u, V_new + i);

#ifdef ACTIVATION
  const real threshold = parameters[(size_t)member * PARAMETERS + PARAM_electrophysiology_activation_threshold_mV];
  const realv before = LOAD(V_before + i);
  const intv crossed = isless(before, (realv)(threshold)) & isgreaterequal(u, (realv)(threshold));
  if (ANY(crossed)) {
#ifdef STRANG
    // What is stored lacks half a step of diffusion at either end; a crossing read from it would be late by first order.
    const realv way = threshold - before - R(0.5) * (diffused - before);
#else
    const realv way = threshold - before;
#endif
    const realv when = time_whole + (time_fraction + dt * way / (u - before));
    for (int k = 0; k < WIDTH; ++k) {
      if (!(LANE(u, k) >= threshold && LANE(before, k) < threshold)) continue;
      if (activation[i + k] < 0) activation[i + k] = (float)LANE(when, k);
#ifdef BEATS
      activation[i + k + (size_t)stride] = (float)LANE(when, k);
      activation[i + k + 2 * (size_t)stride] += 1;
#endif
    }
  }
#endif
}

#ifndef STIMULATED  // once is enough
// V_new = V + dt L V_stage: a stage of a diffusion step alone. Cells without tissue keep their value, whatever their
// neighbours in memory hold.
kernel void diffusion_step(global const real *V_stage, global const real *V, global real *restrict V_new,
                           global const real *restrict stencil, global const real *restrict inverse_capacity,
                           global const int8 *restrict neighbours, const int stride, const real dt) {
  const int i = THIS_CELL;
  const Rows rows = neighbour_rows(neighbours, i);
  const realv V_old = LOAD(V + i), inverse = LOAD(inverse_capacity + i);
  const realv u = fma(dt * inverse, diffusion(V_stage, stencil, stride, rows, i), V_old);
  STORE(WHERE(isgreater(inverse, (realv)(0)), u, V_old), V_new + i);
}
#endif
