// The ECG without reciprocity: the tissue's dipoles -sigma_i grad V lie in the torso, whose potential is solved for
// (elliptic.clh) and read at the electrodes. The pseudo-bidomain approximation: the torso does not act back (Bishop & Plank,
// IEEE Trans. Biomed. Eng. 58, 2297 (2011)).
//
// Needs segments.clh.

// dipoles (3, stride) of the tissue cells, uA mm: sigma_i of a cell times the differences of V across its faces
// (source_faces.cl), the transpose of lead_weights.cl. conductivity (6, stride) xx yy zz xy xz yz, times dx^2.
kernel void tissue_dipoles(global const real *restrict V, global const real *restrict conductivity,
                           global const real *restrict faces, global const int8 *restrict neighbours,
                           global real *restrict dipoles, const int stride) {
  const int i = THIS_CELL;
  const Rows r = neighbour_rows(neighbours, i);
  const size_t row = (size_t)stride;
  global const real *fy = faces + row, *fz = fy + row;
  const realv c = LOAD(V + i);
  const realv x = LOAD(faces + i) * (c - LOAD(V + i - 1)) + LOAD(faces + i + 1) * (LOAD(V + i + 1) - c);
  const realv y = LOAD(fy + i) * (c - LOAD(V + r.ym)) + LOAD(fy + r.yp) * (LOAD(V + r.yp) - c);
  const realv z = LOAD(fz + i) * (c - LOAD(V + r.zm)) + LOAD(fz + r.zp) * (LOAD(V + r.zp) - c);
  global const real *D = conductivity + i;
  const realv xy = LOAD(D + 3 * row), xz = LOAD(D + 4 * row), yz = LOAD(D + 5 * row);
  STORE(-(LOAD(D) * x + xy * y + xz * z), dipoles + i);
  STORE(-(xy * x + LOAD(D + row) * y + yz * z), dipoles + row + i);
  STORE(-(xz * x + yz * y + LOAD(D + 2 * row) * z), dipoles + 2 * row + i);
}

// Dipoles of the tissue as currents of the torso's cells around them, which keep the dipole and have no sum: the gradients
// of the trilinear functions of these cells. Torso cell node[n] takes share[k] . dipole of tissue cell from[k] for k from
// start[n] up to start[n+1]. share (3, entries), 1/mm.
kernel void deposit_dipoles(global const int *restrict node, global const int *restrict start,
                            global const int *restrict from, global const real *restrict share,
                            global const real *restrict dipoles, global real *restrict source, const int nodes,
                            const int entries, const int stride, const real inverse_conductivity) {
  const int n = get_global_id(0);
  if (n >= nodes) return;
  real sum = 0;
  for (int k = start[n]; k < start[n + 1]; ++k)
    for (int a = 0; a < 3; ++a) sum += share[k + a * (size_t)entries] * dipoles[from[k] + a * (size_t)stride];
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
