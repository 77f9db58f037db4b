// The potential at single cells, for the action potentials at probes.

// series (probes, samples): V at `cell` of each probe of each member, in column `sample`.
kernel void record_probes(global const real *restrict V, global const int *restrict cell, global float *restrict series,
                          const int sample, const int samples, const int probes) {
  const int i = get_global_id(0);
  if (i >= probes) return;
  series[i * (size_t)samples + sample] = (float)V[cell[i]];
}
