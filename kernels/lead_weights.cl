// Weights of the ECG: lead(t) = sum_i w_i V_i. With the potential Z of a lead's unit current, reciprocity gives
//     lead = integral Z div(sigma_i grad V) = integral V div(sigma_i grad Z)      (zero flux of sigma_i grad V),
// so w is the diffusion operator of sigma_i, over tissue-to-tissue faces only, applied to Z at the cell centres.
// McFee & Johnston 1953, Circulation 8:554; Geselowitz 1989, Proc. IEEE 77:857. Needs segments.clh, diffusion.clh
// and -D LEADS; Z: sample_leads.cl.

// weights (LEADS, stride), dimensionless: mV of the lead by mV of the cell.
kernel void lead_weights(global const real *restrict potentials, global const real *restrict stencil,
                         global const int8 *restrict neighbours, global real *restrict weights, const int stride) {
  const int i = THIS_CELL;
  const Rows rows = neighbour_rows(neighbours, i);
  for (int q = 0; q < LEADS; ++q) {
    const size_t row = q * (size_t)stride;
    STORE(diffusion(potentials + row, stencil, stride, rows, i), weights + row + i);
  }
}
