// Faces of the ECG's source, the dipoles -sigma_i grad V of the tissue (lead_weights.cl, forward_ecg.cl). Needs segments.clh.
//
// Differences of V are known across the faces between two tissue cells. A cell gives half of its fraction of tissue to each
// of its two faces along an axis, and all of it to the one that remains where the other leads out of the tissue. The faces
// then hold the whole volume along every axis: of a potential that is linear in space no moment is lost, but in cells
// without a neighbour along an axis. A neighbour with less than a quarter of tissue counts for as much less, so that weights
// do not jump where the surface of a heart that is a little larger enters a cell. (In proportion to the whole fraction the
// quadrupole of a ball of 16 mm is off by 0.96 instead of 0.34 % at 1 mm.)
// Unlike a diffusion operator (stencil.cl) a source need not be positive, so that nothing of an anisotropic tensor has to be
// given up in cut cells.

#define COUNTS_FULLY R(0.25)  // as a neighbour, from this fraction of tissue on

// faces (3, stride): what the lower x, y, z face of each cell weighs, over 2: 0 where it is none between tissue cells. It
// multiplies the difference across the face and the sum of the two cells' vectors.
kernel void source_faces(global const int *restrict first_cell, global const int *restrict place,
                         global const real *restrict capacity, global real *restrict faces, const int stride,
                         const int grid_cells) {
  const int i = get_global_id(0);
  const int cell = first_cell[i / LANES] + i % LANES;
  for (int a = 0; a < 3; ++a) {
    real face = 0;
    if (capacity[i] > 0) {
      real share[4], counts[4];  // of the cells two below to one above
      for (int k = 0; k < 4; ++k) {
        const int step = k - 2;
        share[k] = capacity[place_of(place, cell, a == 0 ? step : 0, a == 1 ? step : 0, a == 2 ? step : 0, grid_cells)];
        counts[k] = fmin(share[k], COUNTS_FULLY);
      }
      if (share[1] > 0)
        face = R(0.5) * (share[1] * counts[2] / (counts[0] + counts[2]) + share[2] * counts[1] / (counts[1] + counts[3]));
    }
    faces[i + a * (size_t)stride] = face;
  }
}
