// Total Lagrangian elastodynamics on cut cells, matrix-free, explicit in time. A step is four launches:
//   solid_forces   forces of cells on their nodes; how cavities' volumes depend on their nodes
//   solid_predict                 velocities without the cavities' pressures, and sums over nodes by block
//   a member's kernel             solid_load (prescribed pressures) or the coupled circulation: the pressures, the next step
//   solid_move                    velocities with the pressures, displacements
// Element, cut cells, pressure through the cavity's fraction: solver/README.md. The mean-dilatation pressure: Simo, Taylor &
// Pister, Comput. Methods Appl. Mech. Eng. 51 (1985), with one pressure a cell and U = kappa/2 (J - 1)^2.
// Needs solid_cells.clh, solid_reduce.clh, tension_drive.clh and -D MOST_SLOTS (that a tile can have).
#ifndef MOST_SLOTS
#error "solid_forces.cl needs MOST_SLOTS"
#endif

// Modes of the forces of a cell, by its displacements' modes. quarter: shares of its quarters in tissue, 0 in padding. direction (points, 3), with
// sheets (2, points, 3). activation (cells): ms, negative without. tension (TENSION_FIELDS): the law's states, the stretch of the step before,
// and the tension (kPa).
static inline Modes cell_forces(int i, const Modes m, const Modes rate, const real *quarter,
                         global const real *restrict parameters, global const wide *restrict S, int member,
                         global const uchar *restrict region, global const real *restrict direction,
                         global const real *restrict activation, global real *restrict tension, const int cells,
                         const int odd, global const real *restrict drive, global const real *restrict drive_column,
                         const real4 drive_clock) {
  const real phi = R(0.25) * (quarter[0] + quarter[1] + quarter[2] + quarter[3]);
  if (!(phi > 0)) return no_modes();
  global const real *M = parameters + (size_t)member * PARAMETERS + material_first[region[i]];
  Columns F[POINTS];
  real J = 0, weights = 0, squares = 0;
  for (int g = 0; g < POINTS; ++g) {
    F[g] = deformation(&m, point_offset(g));
    const real weight = fmax(quarter[g], MASS_FLOOR);
    J += weight * determinant(&F[g]);
    weights += weight;
#if TENSION
    squares += quarter[g] * square_stretch(&F[g], direction, i, g);
#endif
  }
  const real pressure = law_pressure(J / weights, M[M_bulk_modulus_kPa]);
#if TENSION
  const real stretch = sqrt(squares / (4 * phi));
  const real dt = S[STEP + 1 - odd];  // of the step behind
  real since = activation[i] < 0 ? R(-1.0) : (real)(S[BEAT_TIME] - (wide)activation[i]);
  if (since < 0 && activation[i] >= 0 && S[BEAT] > 0) since += (real)S[BEAT_LENGTH];
  real states[TENSION_STATES + 1];
  global real *of_tension = tension + in_tile(i, 0, TENSION_FIELDS);
  for (int k = 0; k < TENSION_STATES; ++k) states[k] = of_tension[k * SOLID_BLOCK];
  const real before = of_tension[TENSION_STATES * SOLID_BLOCK];
  const real T = (real)S[LOAD] *
                 tension_step(states, since, (real)S[BEAT_LENGTH],
                              tension_drive(drive, drive_column, i, cells, member, activation[i] >= 0, since - R(0.5) * dt,
                                            (real)S[BEAT_TIME] - R(0.5) * dt, (real)S[BEAT_LENGTH], drive_clock),
                              stretch, dt > 0 ? (stretch - before) / dt : R(0.0), dt, M);
  for (int k = 0; k < TENSION_STATES; ++k) of_tension[k * SOLID_BLOCK] = states[k];
  of_tension[TENSION_STATES * SOLID_BLOCK] = stretch;
  of_tension[(TENSION_STATES + 1) * SOLID_BLOCK] = T;
  const real per_stretch = tension_per_stretch(T, stretch);
#else
  const real per_stretch = 0;
#endif
  Modes sum = no_modes();
  for (int g = 0; g < POINTS; ++g) {
    const real3 e = point_offset(g);
#ifdef VISCOUS
    const Columns D = gradient_at(&rate, e);
#else
    const Columns D = {(real3)(0), (real3)(0), (real3)(0)};
#endif
    const Columns P = point_stress(&F[g], &D, direction_at(direction, i, g), sheet_at(direction, i, g),
                                   fmax(quarter[g], MASS_FLOOR), quarter[g] * per_stretch, pressure, M);
    add_stress(&sum, &P, e);
  }
  return sum;
}

// Of a cell's velocities, 1/ms; nothing where no tissue is viscous.
inline Modes viscous_rate(global const real *restrict v, global const int *restrict cell_nodes, int i, int cells, int nodes_stride,
                          real h) {
#ifdef VISCOUS
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  return cell_modes(v, nodes, nodes_stride, R(0.25) / h);
#else
  return no_modes();
#endif
}

#ifdef GPU
#define TILE local
#else
#define TILE private
#endif

// By the displacements (slots) of a cell's corners, in its tile.
inline Modes tile_modes(TILE const real4 *field, const int *slot, real scale) {
  real3 n[8];
  for (int c = 0; c < 8; ++c) n[c] = scale * field[slot[c]].xyz;
  return modes_of(n);
}

// Area of a face by its corners, (integral of N_a n) for each; n points as dxi x deta. 2 x 2 Gauss points are exact. Returns the
// integral of (w x) . n, w by component.
inline real face_areas(const real3 *x, real3 w, real3 *area) {
  real flux = 0;
  for (int a = 0; a < 4; ++a) area[a] = (real3)(0);
  for (int g = 0; g < 4; ++g) {
    const real s = R(0.5) + (g & 1 ? R(0.5) : R(-0.5)) * GAUSS, t = R(0.5) + (g & 2 ? R(0.5) : R(-0.5)) * GAUSS;
    const real weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    const real3 n = R(0.25) * cross((1 - t) * (x[1] - x[0]) + t * (x[3] - x[2]), (1 - s) * (x[2] - x[0]) + s * (x[3] - x[1]));
    for (int a = 0; a < 4; ++a) area[a] += weight[a] * n;
    flux += dot(w * (weight[0] * x[0] + weight[1] * x[1] + weight[2] * x[2] + weight[3] * x[3]), n);
  }
  return flux;
}

// What a cell of tissue adds to a cavity, its volume returned: its own blood, share chi of the cell, and the faces behind which blood alone
// lies, each weighted. of_corner (8): derivative of the cavity's volume by the node's place, mm2. The faces'
// part is the flux of a field of divergence 1. lid (members, CAVITIES, 6): a point of the plane in which the cavity is cut
// open, and the weights of the field's components: none across the plane, so that a lid that moves there adds nothing.
// item_faces, by tiles (6): -x +x -y +y -z +z. at (slots): displacements of the tile of items.
inline real cavity_part(int j, int cell, int cavity, TILE const real4 *at, const int *slot, global const real *restrict item_share,
                        global const real *restrict item_faces, global const int *restrict cell_nodes,
                        global const real *restrict position, global const real *restrict lid, const int nodes_stride, const real h,
                        real3 *of_corner) {
  const Modes m = tile_modes(at, slot, R(0.25) / h);
  real chi[POINTS];
  load_shares(item_share, j, chi);
  Modes sum = no_modes();
  real J = 0;
  for (int g = 0; g < POINTS; ++g) {
    const real3 e = point_offset(g);
    const Columns F = deformation(&m, e), K = cofactor(&F);
    J += R(0.25) * chi[g] * dot(F.x, K.x);
    const Columns weighted = {chi[g] * K.x, chi[g] * K.y, chi[g] * K.z};
    add_stress(&sum, &weighted, e);
  }
  at_corners(&sum, h * h / 16, of_corner);
  real total = h * h * h * J;

  const real3 origin = vload3(2 * cavity, lid), along = vload3(2 * cavity + 1, lid);
  const int first = cell_nodes[cell];
  const real3 corner_0 =
      (real3)(position[first], position[first + (size_t)nodes_stride], position[first + 2 * (size_t)nodes_stride]) - origin;
  real3 x[8];
  for (int c = 0; c < 8; ++c) x[c] = corner_0 + h * (real3)((real)(c & 1), (real)(c >> 1 & 1), (real)(c >> 2)) + at[slot[c]].xyz;
#pragma unroll
  for (int face = 0; face < 6; ++face) {
    const real weight = item_faces[in_tile(j, face, 6)];
    if (!(weight > 0)) continue;
    const int axis = face / 2, p = axis == 0 ? 1 : 0, q = axis == 2 ? 1 : 2;  // axes of the face, p < q
    const int base = face % 2 ? 1 << axis : 0;
    const int corner[4] = {base, base + (1 << p), base + (1 << q), base + (1 << p) + (1 << q)};
    real3 y[4], area[4];
    for (int a = 0; a < 4; ++a) y[a] = x[corner[a]];
    // dxi x deta points along +axis, but for axis y; blood's outward normal points into the cell.
    const real sign = ((axis == 1) == (face % 2 == 0)) ? -weight : weight;
    total += sign * face_areas(y, along, area);
    for (int a = 0; a < 4; ++a) of_corner[corner[a]] += sign * area[a];
  }
  return total;
}

// Sums over a tile are stored: (3, slots).
inline void store_slot(real4 sum, global real *restrict field, int slot, int slots) {
  field[slot] = sum.x;
  field[slot + (size_t)slots] = sum.y;
  field[slot + 2 * (size_t)slots] = sum.z;
}

inline real4 displacement_at(global const real *restrict u, int a, int stride) {
  return (real4)(u[a], u[a + (size_t)stride], u[a + 2 * (size_t)stride], 0);
}

// Displacements of a tile's nodes, and no sums yet; slot_node from the tile's first slot on.
inline void begin_tile(global const int *restrict slot_node, int count, global const real *restrict u, int nodes_stride, TILE real4 *at,
                       TILE real4 *sum) {
#ifdef GPU
  for (int k = get_local_id(0); k < count; k += SOLID_BLOCK) {
#else
  for (int k = 0; k < count; ++k) {
#endif
    at[k] = displacement_at(u, slot_node[k], nodes_stride);
    sum[k] = (real4)(0);
  }
#ifdef GPU
  barrier(CLK_LOCAL_MEM_FENCE);
#endif
}

#ifdef GPU
// A node is corner c of one cell at most.
inline void add_to_tile(const real3 *of_corner, const int *slot, bool tissue, local real4 *sum) {
#pragma unroll
  for (int c = 0; c < 8; ++c) {
    if (tissue) sum[slot[c]] += (real4)(of_corner[c], 0);
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}
#endif

#if CAVITIES > 0
// A block of items: the volume they add to their cavity, and its gradient (3, item_slots) summed up by node.
inline void solid_items(int block, int member, global const int *restrict item_cell, global const uchar *restrict item_cavity,
                        global const real *restrict item_share, global const real *restrict item_faces,
                        global const int *restrict item_tile_slots, global const int *restrict item_slot_node,
                        global const ushort *restrict item_slots, global const int *restrict cell_nodes,
                        global const real *restrict position, global const real *restrict lid, global const real *restrict u,
                        global real *restrict gradient, global real *restrict volume, local real4 *restrict scratch, int nodes_stride,
                        int gradient_slots, int most, real h) {
  const int first = item_tile_slots[block], count = item_tile_slots[block + 1] - first;
  const int cavity = member * CAVITIES + item_cavity[block * SOLID_BLOCK];
  real3 of_corner[8];
  int slot[8];
#ifdef GPU
  const int own = get_local_id(0), j = block * SOLID_BLOCK + own, cell = item_cell[j];
#pragma unroll
  for (int c = 0; c < 8; ++c) slot[c] = item_slots[in_tile(j, c, 8)];
  local real4 *at = scratch, *sum = scratch + most;
  begin_tile(item_slot_node + first, count, u, nodes_stride, at, sum);
  real mm3 = cell < 0 ? R(0.0)
                      : cavity_part(j, cell, cavity, at, slot, item_share, item_faces, cell_nodes, position, lid, nodes_stride, h,
                                    of_corner);
  add_to_tile(of_corner, slot, cell >= 0, sum);
  for (int k = own; k < count; k += SOLID_BLOCK) store_slot(sum[k], gradient, first + k, gradient_slots);
  barrier(CLK_LOCAL_MEM_FENCE);
  sums_of_block(&mm3, 1, (local real *)scratch);
  if (own == 0) volume[block] = ((local real *)scratch)[0];
#else
  real4 at[MOST_SLOTS], sum[MOST_SLOTS];
  real mm3 = 0;
  begin_tile(item_slot_node + first, count, u, nodes_stride, at, sum);
  for (int j = block * SOLID_BLOCK; j < (block + 1) * SOLID_BLOCK; ++j) {
    const int cell = item_cell[j];
    if (cell < 0) continue;
    for (int c = 0; c < 8; ++c) slot[c] = item_slots[in_tile(j, c, 8)];
    mm3 += cavity_part(j, cell, cavity, at, slot, item_share, item_faces, cell_nodes, position, lid, nodes_stride, h, of_corner);
    for (int c = 0; c < 8; ++c) sum[slot[c]] += (real4)(of_corner[c], 0);
  }
  for (int k = 0; k < count; ++k) store_slot(sum[k], gradient, first + k, gradient_slots);
  volume[block] = mm3;
#endif
}
#endif

// The cells' forces (3, slots), mN, each tile's added up by node, and what cavities' volumes depend on: two short launches in one. A work-group (a
// work-item on CPUs) is a tile or a block of items. most: slots of the largest tile (of cells or items). pulls (tiles), where pressures are prescribed: sum of the
// squares of the cells' forces. volume (blocks of items): mm3.
kernel void solid_forces(global const real *restrict parameters, global const wide *restrict state,
                         global const ushort *restrict member_of, global const int *restrict cell_nodes,
                         global const int *restrict tile_slots, global const int *restrict slot_node,
                         global const ushort *restrict cell_slots, global const real *restrict share,
                         global const uchar *restrict region, global const real *restrict direction,
                         global const real *restrict activation, global real *restrict tension,
                         global const real *restrict u, global const real *restrict v, global real *restrict force,
                         global real *restrict pulls, global const ushort *restrict member_of_item,
                         global const int *restrict item_cell, global const uchar *restrict item_cavity,
                         global const real *restrict item_share, global const real *restrict item_faces,
                         global const int *restrict item_tile_slots, global const int *restrict item_slot_node,
                         global const ushort *restrict item_slots, global const real *restrict position, global const real *restrict lid,
                         global real *restrict gradient, global real *restrict volume, local real4 *restrict scratch,
                         const int cells, const int nodes_stride, const int slots,
                         const int gradient_slots, const int most,
                         const real h, const int odd, global const real *restrict drive,
                         global const real *restrict drive_column, const real4 drive_clock) {
#ifdef GPU
  const int tile = get_group_id(0), own = get_local_id(0);
#else
  const int tile = get_global_id(0);
#endif
#if CAVITIES > 0
  if (tile >= cells / SOLID_BLOCK) {
    const int block = tile - cells / SOLID_BLOCK;
    if (state[member_of_item[block] * MEMBER_STATE + ENDED] != 0) return;
    solid_items(block, member_of_item[block], item_cell, item_cavity, item_share, item_faces, item_tile_slots, item_slot_node, item_slots,
                cell_nodes, position, lid, u, gradient, volume, scratch, nodes_stride, gradient_slots, most, h);
    return;
  }
#endif
  const int member = member_of[tile], first = tile_slots[tile], count = tile_slots[tile + 1] - first;
  global const wide *S = state + member * MEMBER_STATE;
  if (STANDS(S)) return;
#ifdef GPU
  // What does not depend on the tile's nodes is asked for first.
  const int i = tile * SOLID_BLOCK + own;
  int slot[8];
#pragma unroll
  for (int c = 0; c < 8; ++c) slot[c] = cell_slots[in_tile(i, c, 8)];
  real quarter[POINTS];
  load_shares(share, i, quarter);
  local real4 *at = scratch, *sum = scratch + most;
  begin_tile(slot_node + first, count, u, nodes_stride, at, sum);
  const Modes rate = viscous_rate(v, cell_nodes, i, cells, nodes_stride, h);
  const Modes f = cell_forces(i, tile_modes(at, slot, R(0.25) / h), rate, quarter, parameters, S, member, region, direction,
                              activation, tension, cells, odd, drive, drive_column, drive_clock);
  const bool tissue = quarter[0] + quarter[1] + quarter[2] + quarter[3] > 0;
  real3 of_corner[8];
  at_corners(&f, -h * h / 16, of_corner);
  add_to_tile(of_corner, slot, tissue, sum);
  for (int k = own; k < count; k += SOLID_BLOCK) store_slot(sum[k], force, first + k, slots);
#if !BEATS
  real pull = 0;
  for (int c = 0; c < 8; ++c) pull += tissue ? dot(of_corner[c], of_corner[c]) : R(0.0);
  barrier(CLK_LOCAL_MEM_FENCE);
  sums_of_block(&pull, 1, (local real *)scratch);
  if (own == 0) pulls[tile] = ((local real *)scratch)[0];
#endif
#else
  real4 at[MOST_SLOTS], sum[MOST_SLOTS];
  real pull = 0;
  begin_tile(slot_node + first, count, u, nodes_stride, at, sum);
  for (int i = tile * SOLID_BLOCK; i < (tile + 1) * SOLID_BLOCK; ++i) {
    real quarter[POINTS];
    load_shares(share, i, quarter);
    int slot[8];
    for (int c = 0; c < 8; ++c) slot[c] = cell_slots[in_tile(i, c, 8)];
    const Modes rate = viscous_rate(v, cell_nodes, i, cells, nodes_stride, h);
    const Modes f = cell_forces(i, tile_modes(at, slot, R(0.25) / h), rate, quarter, parameters, S, member, region,
                                direction, activation, tension, cells, odd, drive, drive_column, drive_clock);
    real3 of_corner[8];
    at_corners(&f, -h * h / 16, of_corner);
    for (int c = 0; c < 8; ++c) {
      sum[slot[c]] += (real4)(of_corner[c], 0);
      pull += dot(of_corner[c], of_corner[c]);
    }
  }
  for (int k = 0; k < count; ++k) store_slot(sum[k], force, first + k, slots);
#if !BEATS
  pulls[tile] = pull;
#endif
#endif
}
