// What excited cells and deforming tissue give each other at the ends of windows of time: potential or calcium to the tension, stretch to
// the cells. Needs solid_tile.clh, segments.clh and -D PARAMETERS;  -D CALCIUM: intracellular calcium drives the tension, then calcium_state[] by
// region from the host: the place of calcium among the states of its cell model.
#ifndef PARAMETERS
#error "electromechanics.cl needs PARAMETERS"
#endif

// A cell of the mechanics takes the mean over places[first[i]] ... of the excited cells in it. source: V (stride) mV, or states (states,
// stride). drive (2, cells): the end of a window becomes the begin of the next one; with `both` that is the new value too. Cells without an excited
// one keep what they have.
kernel void bring_drive(global const real *restrict source, global const uchar *restrict tissue_region_of,
                        global const int *restrict first, global const int *restrict places, global real *restrict drive,
                        const int stride, const int cells, const int both) {
  const int i = get_global_id(0), from = first[i], to = first[i + 1];
  if (to <= from) return;
  real sum = 0;
  for (int k = from; k < to; ++k) {
    const int place = places[k];
#ifdef CALCIUM
    sum += source[place + calcium_state[tissue_region_of[place]] * (size_t)stride];
#else
    sum += source[place];
#endif
  }
  const real value = sum / (to - from);
  drive[i] = both ? value : drive[i + (size_t)cells];
  drive[i + (size_t)cells] = value;
}

// activation (cells): time of the latest activation in a beat, of the first of its excited cells; negative before any.
kernel void bring_activation(global const float *restrict times, global const int *restrict first,
                             global const int *restrict places, global real *restrict activation) {
  const int i = get_global_id(0);
  if (first[i + 1] <= first[i]) return;
  const real time = times[places[first[i]]];
  if (time >= 0) activation[i] = time;
}

#ifdef STRETCH_ACTIVATED
// Rate of the stretch-activated current (monodomain.cl), 1/ms: g (lambda - 1) / (lambda_max - 1) for a stretch lambda > 1 along the fibres of
// the mechanics' cell that holds this one: field `stretch` of `fields` of its tension. cell_of (stride): -1 without.
kernel void bring_stretch(global const real *restrict tension, global const int *restrict cell_of,
                          global const ushort *restrict member_of, global const real *restrict parameters,
                          global real *restrict rate, const int stretch, const int fields) {
  const int i = get_global_id(0), cell = cell_of[i];
  if (cell < 0) return;
  global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
  const real longer = fmax(tension[in_tile(cell, stretch, fields)] - 1, R(0.0));
  rate[i] = P[PARAM_electrophysiology_stretch_activated_conductance_mS_per_uF] * longer /
            (P[PARAM_electrophysiology_stretch_activated_reference_stretch] - 1);
}
#endif
