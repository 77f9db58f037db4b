// Weights of the ECG: lead(t) = sum_i w_i V_i. With the potential Z of a lead's unit current, reciprocity gives
//     lead = - integral J . grad V,     J = sigma_i grad Z.
// McFee & Johnston 1953, Circulation 8:554; Geselowitz 1989, Proc. IEEE 77:857. J: sample_leads.cl. Of the integral each
// face between tissue cells has the difference of V across it times the mean of J's component in the two cells and their
// fractions of tissue (source_faces.cl). What one cell gains the other loses: potentials that are the same everywhere have
// no ECG. Independent leads from electrodes RA LA LL V1 ... V6: I, II, V1 to V6 against Wilson's terminal.
// Needs segments.clh and -D ELECTRODES_A_PASS (3: the limbs, V1 to V3, V4 to V6).
#if ELECTRODES_A_PASS != 3
#error "lead_weights.cl takes the electrodes in threes"
#endif

// Weights of an electrode: J (3, stride).
inline realv electrode_weights(global const real *restrict J, global const real *restrict faces, const int stride,
                               const Rows r, const int i) {
  global const real *Jy = J + (size_t)stride, *Jz = Jy + (size_t)stride;
  global const real *fy = faces + (size_t)stride, *fz = fy + (size_t)stride;
  const realv x = LOAD(J + i), y = LOAD(Jy + i), z = LOAD(Jz + i);
  return LOAD(faces + i + 1) * (x + LOAD(J + i + 1)) - LOAD(faces + i) * (x + LOAD(J + i - 1)) +
         LOAD(fy + r.yp) * (y + LOAD(Jy + r.yp)) - LOAD(fy + i) * (y + LOAD(Jy + r.ym)) +
         LOAD(fz + r.zp) * (z + LOAD(Jz + r.zp)) - LOAD(fz + i) * (z + LOAD(Jz + r.zm));
}

// weights (LEADS, stride), dimensionless: mV of the lead by mV of the cell. currents (ELECTRODES_A_PASS, 3, stride) of
// electrodes from first_electrode on, uA/mm times mm^2 by uA; the limbs come first. first: first cell of the
// member.
kernel void lead_weights(global const real *restrict currents, global const real *restrict faces,
                         global const int8 *restrict neighbours, global real *restrict weights, const int stride,
                         const int first, const int first_electrode) {
  const int i = first + (int)get_global_id(0) * WIDTH;
  const Rows rows = neighbour_rows(neighbours, i);
  realv w[3];
  for (int e = 0; e < 3; ++e) w[e] = electrode_weights(currents + 3 * e * (size_t)stride, faces, stride, rows, i);
  if (first_electrode == 0) {
    const realv wilson = (w[0] + w[1] + w[2]) / 3;
    STORE(w[1] - w[0], weights + i);
    STORE(w[2] - w[0], weights + (size_t)stride + i);
    for (int v = 2; v < LEADS; ++v) STORE(-wilson, weights + v * (size_t)stride + i);
  } else {
    for (int e = 0; e < 3; ++e) {
      global real *lead = weights + (first_electrode - 1 + e) * (size_t)stride + i;
      STORE(LOAD(lead) + w[e], lead);
    }
  }
}
