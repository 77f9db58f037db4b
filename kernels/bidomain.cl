// The bidomain equations on the compact tissue and on the box of elliptic.clh that just holds what conducts:
//   dV/dt = L_i (V + phi_e) - I_ion / C_m,   (L_i + L_e) phi_e = -L_i V - I,   L = div(sigma grad) / (chi C_m)
// (Keener & Sneyd, Mathematical Physiology, section 12.2; Pathmanathan & Gray 2014, doi 10.1002/cnm.2615). L_i lives on
// the tissue and lets no current of V + phi_e through its surface; L_e on tissue and bath, with sigma_e in the one and
// sigma_b in the other. Assembled as energies (stencil.cl), both keep their boundary conditions whatever the surface.
//
// Needs segments.clh, diffusion.clh.

// A box of the grid: the place of its first cell, and its extents.
#define BOX_ARGUMENTS const int lower_x, const int lower_y, const int lower_z, const int nx, const int ny, const int nz
#define BOX_PLACE(cell, lane)                                                       \
  box_place((cell) % NX + (lane)-lower_x, (cell) / NX % NY - lower_y, (cell) / (NX * NY) % NZ - lower_z, nx, ny, nz)

// Place in a field of elliptic.clh, ghosts included; -1 outside the box.
inline int box_place(int x, int y, int z, int nx, int ny, int nz) {
  if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) return -1;
  return (x + 1) + (nx + 2) * ((y + 1) + (ny + 2) * (z + 1));
}

// Adds the couplings of a compact stencil to faces (3, box) and cross (3, box), zeroed before. Range: the cells from
// `first` on.
kernel void add_couplings(global const int *restrict first_cell, global const real *restrict capacity,
                          global const real *restrict stencil, global real *restrict faces, global real *restrict cross,
                          BOX_ARGUMENTS, const int stride, const int first) {
  const int i = first + get_global_id(0);
  if (!(capacity[i] > 0)) return;
  const int c = BOX_PLACE(first_cell[i / LANES], i % LANES), cells = (nx + 2) * (ny + 2) * (nz + 2);
  if (c < 0) return;
  for (int k = 0; k < 3; ++k) {
    faces[c + k * cells] += stencil[i + k * (size_t)stride];
    cross[c + k * cells] += stencil[i + (3 + k) * (size_t)stride];
  }
}

// Source of phi_e: what leaves a cell by phi_e enters it by V, and `share` of the current injected (injected: 0 unless
// there is any). source (box): zero, or the injected current's share, wherever there is no tissue.
kernel void bidomain_source(global const real *restrict V, global const real *restrict stencil,
                            global const real *restrict capacity, global const int8 *restrict neighbours,
                            global const int *restrict first_cell, global const real *restrict injected,
                            global real *restrict source, BOX_ARGUMENTS, const int stride, const int first,
                            const real share) {
  const int i = first + (int)get_global_id(0) * WIDTH;
  const realv current = diffusion(V, stencil, stride, neighbour_rows(neighbours, i), i);
  const int cell = first_cell[i / LANES];
  for (int k = 0; k < WIDTH; ++k) {
    if (!(capacity[i + k] > 0)) continue;
    const int c = BOX_PLACE(cell, i % LANES + k);
    if (c >= 0) source[c] = LANE(current, k) + (share != 0 ? share * injected[c] : 0);
  }
}

// source = share * injected, wherever; before bidomain_source. Range: the box, ghosts included.
kernel void injected_source(global const real *restrict injected, global real *restrict source, const int cells,
                            const real share) {
  const int c = get_global_id(0);
  if (c >= cells) return;
  source[c] = share * injected[c];
}

// A first guess of phi_e from its last two values, which it replaces: linear in time. Range: the box.
kernel void extrapolate(global real *restrict phi, global real *restrict phi_before, const int cells) {
  const int c = get_global_id(0);
  if (c >= cells) return;
  const real now = phi[c];
  phi[c] = 2 * now - phi_before[c];
  phi_before[c] = now;
}

// phi_e and V + phi_e of the tissue cells from `first` on; 0 and V where there is none.
kernel void gather_extracellular(global const real *restrict phi, global const real *restrict V,
                                 global const real *restrict capacity, global const int *restrict first_cell,
                                 global real *restrict extracellular, global real *restrict intracellular,
                                 BOX_ARGUMENTS, const int first) {
  const int i = first + get_global_id(0);
  const int c = capacity[i] > 0 ? BOX_PLACE(first_cell[i / LANES], i % LANES) : -1;
  const real value = c >= 0 ? phi[c] : 0;
  extracellular[i] = value;
  intracellular[i] = V[i] + value;
}

// V after the last stage of a step of diffusion: base + dt L_i stage, potentials V + phi_e both, less phi_e.
//
// The step is the explicit midpoint rule for dV/dt = L_i (V + phi_e(V)), of second order: half a step beside phi_e(V) gives
// the V of the middle, and a whole step of the midpoint rule beside the phi_e of that, which stays, gives V. phi_e that stays
// cannot make substeps unstable: with phi_e = -K V, the eigenvalues of K between 0 and 1, and a mode of L_i that alone falls
// by a factor between 0 and 1, so does V.
kernel void bidomain_diffusion(global const real *stage, global const real *base, global const real *restrict extracellular,
                               global real *restrict V, global const real *restrict stencil,
                               global const real *restrict inverse_capacity, global const int8 *restrict neighbours,
                               const int stride, const real dt) {
  const int i = THIS_CELL;
  const Rows rows = neighbour_rows(neighbours, i);
  const realv inverse = LOAD(inverse_capacity + i), old = LOAD(base + i);
  const realv u = fma(dt * inverse, diffusion(stage, stencil, stride, rows, i), old);
  STORE(WHERE(isgreater(inverse, (realv)(0)), u, old) - LOAD(extracellular + i), V + i);
}
