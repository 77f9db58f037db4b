// The ECG without reciprocity: the tissue's currents div(sigma_i grad V) flow into the torso, whose potential is solved
// for (elliptic.clh) and read at the electrodes. The pseudo-bidomain approximation: the torso does not act back (Bishop &
// Plank, IEEE Trans. Biomed. Eng. 58, 2297 (2011)).
//
// Needs segments.clh, diffusion.clh.

// Current out of the tissue cells, uA: the stencil is sigma_i dx.
kernel void tissue_currents(global const real *restrict V, global const real *restrict stencil,
                            global const int8 *restrict neighbours, global real *restrict current, const int stride) {
  const int i = THIS_CELL;
  STORE(diffusion(V, stencil, stride, neighbour_rows(neighbours, i), i), current + i);
}

// Currents of the tissue into the cells of the torso around them, in shares that keep their sum and their first moment
// (trilinear). Torso cell node[n] takes share[k] of tissue cell from[k] for k from start[n] up to start[n+1].
kernel void deposit_currents(global const int *restrict node, global const int *restrict start,
                             global const int *restrict from, global const real *restrict share,
                             global const real *restrict current, global real *restrict source, const int nodes,
                             const real inverse_conductivity) {
  const int n = get_global_id(0);
  if (n >= nodes) return;
  real sum = 0;
  for (int k = start[n]; k < start[n + 1]; ++k) sum += share[k] * current[from[k]];
  source[node[n]] = inverse_conductivity * sum;
}

// The eight independent leads (lead_weights.cl) of the potential in a torso, read by the electrodes' weights (torso.cl),
// into series[offset] and behind. One work-item.
kernel void read_leads(global const real *restrict potential, global const real *restrict weights,
                       global const int *restrict windows, const int row, const int plane,
                       global real *restrict series, const int offset) {
  real phi[9];
  for (int e = 0; e < 9; ++e) {
    const int first = windows[3 * e] + row * windows[3 * e + 1] + plane * windows[3 * e + 2];
    real sum = 0;
    for (int n = 0; n < 64; ++n) {
      const real weight = weights[64 * e + n];
      if (weight != 0) sum += weight * potential[first + n % 4 + row * (n / 4 % 4) + plane * (n / 16)];
    }
    phi[e] = sum;
  }
  const real wilson = (phi[0] + phi[1] + phi[2]) / 3;
  series[offset] = phi[1] - phi[0];
  series[offset + 1] = phi[2] - phi[0];
  for (int v = 0; v < 6; ++v) series[offset + 2 + v] = phi[3 + v] - wilson;
}
