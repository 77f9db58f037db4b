// Total Lagrangian elastodynamics on cut cells, matrix-free, explicit in time. A step is four launches:
//   solid_forces   forces of cells on their nodes; how cavities' volumes depend on their nodes
//   solid_predict                 velocities without the cavities' pressures, and sums over nodes by block
//   a member's kernel             solid_load (prescribed pressures) or the coupled circulation: the pressures, the next step
//   solid_move                    velocities with the pressures, displacements
// Element, cut cells, pressure through the cavity's fraction: solver/README.md. The mean-dilatation pressure: Simo, Taylor &
// Pister, Comput. Methods Appl. Mech. Eng. 51 (1985), with one pressure a cell and U = kappa/2 (J - 1)^2.
// Needs solid.clh, symmetric.clh, a law, a tension law (or none) and -D PARAMETERS, MASS_FLOOR, MOST_SLOTS (that a tile can have); -D VISCOUS
// where some tissue is.
#if !defined(PARAMETERS) || !defined(MASS_FLOOR) || !defined(MOST_SLOTS)
#error "solid_cells.cl needs PARAMETERS, MASS_FLOOR, MOST_SLOTS"
#endif

// The law's own energy of a change of volume, else kappa/2 (J - 1)^2.
#ifndef LAW_PRESSURE
inline real law_pressure(real J, real kappa) { return kappa * (J - 1); }
inline real law_volume_energy(real J, real kappa) { return R(0.5) * kappa * (J - 1) * (J - 1); }
#endif

inline void load_nodes(global const int *restrict cell_nodes, int i, int stride, int *nodes) {
  for (int c = 0; c < 8; ++c) nodes[c] = cell_nodes[i + (size_t)c * stride];
}

inline Columns deformation(const Modes *m, real3 e) {
  Columns F = gradient_at(m, e);
  F.x.x += R(1.0);
  F.y.y += R(1.0);
  F.z.z += R(1.0);
  return F;
}

// Shares of the points' quarters of a cell.
inline void load_shares(global const real *restrict share, int i, int stride, real *quarter) {
  for (int g = 0; g < POINTS; ++g) quarter[g] = share[i + (size_t)g * stride];
}

// Mean over the points of det F, weighted as stress is.
inline real mean_volume_ratio(const Modes *m, const real *quarter) {
  real J = 0, all = 0;
  for (int g = 0; g < POINTS; ++g) {
    const Columns F = deformation(m, point_offset(g));
    const real weight = fmax(quarter[g], MASS_FLOOR);
    J += weight * determinant(&F);
    all += weight;
  }
  return J / all;
}

inline real3 direction_at(global const real *restrict direction, int i, int stride, int k) {
  return (real3)(direction[i + (size_t)(3 * k) * stride], direction[i + (size_t)(3 * k + 1) * stride],
                 direction[i + (size_t)(3 * k + 2) * stride]);
}

inline real3 apply(const Columns *F, real3 v) {
  return F->x * v.x + F->y * v.y + F->z * v.z;
}

#if TENSION
// Stretch along the fibres of a cell: root mean square over its points, weighted as the active stress is, so that this has an
// energy: with other weights the stress did work in a cycle, and single cut cells shook the valves late in systole.
inline real square_stretch(const Columns *F, global const real *restrict direction, int i, int stride, int g) {
  const real3 Ff = apply(F, direction_at(direction, i, stride, g));
  return dot(Ff, Ff);
}
inline real fibre_stretch(const Modes *m, const real *quarter, global const real *restrict direction, int i, int stride) {
  real sum = 0, all = 0;
  for (int g = 0; g < POINTS; ++g) {
    const Columns F = deformation(m, point_offset(g));
    sum += quarter[g] * square_stretch(&F, direction, i, stride, g);
    all += quarter[g];
  }
  return sqrt(sum / all);
}
#endif

inline real3 sheet_at(global const real *restrict direction, int i, int stride, int g) {
#if LAW_SHEETS
  return direction_at(direction, i, stride, POINTS + g);
#else
  return (real3)(0);
#endif
}

#if TENSION
// The factor of F f (x) f in the first Piola-Kirchhoff stress, kPa.
inline real tension_per_stretch(real T, real stretch) {
#if TENSION_PER_STRETCH2
  return T / (stretch * stretch);
#else
  return T;
#endif
}
#endif

// First Piola-Kirchhoff stress at a point, kPa, by columns: the law's and the pressure's times `weight`, of the tension `active`. D: rate of
// F, 1/ms, read where tissue is viscous.
inline Columns point_stress(const Columns *F, const Columns *D, real3 f, real3 s, real weight, real active, real pressure,
                            global const real *restrict M) {
  const Columns K = cofactor(F);
  const symmetric C = right_cauchy_green(F->x, F->y, F->z);
  symmetric stress = law_stress(C, dot(F->x, K.x), f, s, M);
#ifdef VISCOUS
  const real eta = M[M_viscosity_kPa_ms];
  stress.xx += eta * dot(F->x, D->x);
  stress.yy += eta * dot(F->y, D->y);
  stress.zz += eta * dot(F->z, D->z);
  stress.yz += R(0.5) * eta * (dot(F->y, D->z) + dot(F->z, D->y));
  stress.xz += R(0.5) * eta * (dot(F->x, D->z) + dot(F->z, D->x));
  stress.xy += R(0.5) * eta * (dot(F->x, D->y) + dot(F->y, D->x));
#endif
  stress = sym_scaled(weight, stress);
#if TENSION
  stress = sym_fma(active, sym_square(f), stress);
#endif
  const real volumetric = weight * pressure;
  const Columns P = {
      F->x * stress.xx + F->y * stress.xy + F->z * stress.xz + volumetric * K.x,
      F->x * stress.xy + F->y * stress.yy + F->z * stress.yz + volumetric * K.y,
      F->x * stress.xz + F->y * stress.yz + F->z * stress.zz + volumetric * K.z,
  };
  return P;
}

// Modes of the forces of a cell, by its displacements' modes. quarter: shares of its quarters in tissue, 0 in padding. direction (points, 3,
// cells), with sheets (2, points, 3, cells). activation (cells): ms, negative without. tension (TENSION_STATES + 2, cells): the
// law's states, the stretch of the step before, and the tension (kPa).
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
    squares += quarter[g] * square_stretch(&F[g], direction, i, cells, g);
#endif
  }
  const real pressure = law_pressure(J / weights, M[M_bulk_modulus_kPa]);
#if TENSION
  const real stretch = sqrt(squares / (4 * phi));
  const real dt = S[STEP + 1 - odd];  // of the step behind
  real since = activation[i] < 0 ? R(-1.0) : (real)(S[BEAT_TIME] - (wide)activation[i]);
  if (since < 0 && activation[i] >= 0 && S[BEAT] > 0) since += (real)S[BEAT_LENGTH];
  real states[TENSION_STATES + 1];
  for (int k = 0; k < TENSION_STATES; ++k) states[k] = tension[i + (size_t)k * cells];
  const real before = tension[i + (size_t)TENSION_STATES * cells];
  const real T = (real)S[LOAD] *
                 tension_step(states, since, (real)S[BEAT_LENGTH],
                              tension_drive(drive, drive_column, i, cells, member, activation[i] >= 0, since - R(0.5) * dt,
                                            (real)S[BEAT_TIME] - R(0.5) * dt, (real)S[BEAT_LENGTH], drive_clock),
                              stretch, dt > 0 ? (stretch - before) / dt : R(0.0), dt, M);
  for (int k = 0; k < TENSION_STATES; ++k) tension[i + (size_t)k * cells] = states[k];
  tension[i + (size_t)TENSION_STATES * cells] = stretch;
  tension[i + (size_t)(TENSION_STATES + 1) * cells] = T;
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
    const Columns P = point_stress(&F[g], &D, direction_at(direction, i, cells, g), sheet_at(direction, i, cells, g),
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

// The displacements (3, slots) of a cell's corners, in its tile.
inline Modes tile_modes(TILE const real *field, const int *slot, int stride, real scale) {
  real3 n[8];
  for (int c = 0; c < 8; ++c) n[c] = scale * (real3)(field[slot[c]], field[slot[c] + stride], field[slot[c] + 2 * stride]);
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
// lies, each weighted. gradient (8, 3, items): derivative of the cavity's volume by the node's place, mm2. The faces'
// part is the flux of a field of divergence 1. lid (members, CAVITIES, 6): a point of the plane in which the cavity is cut
// open, and the weights of the field's components: none across the plane, so that a lid that moves there adds nothing.
// item_faces (6, items): -x +x -y +y -z +z.
static inline real cavity_forces(int j, global const wide *restrict state, global const ushort *restrict member_of_item,
                          global const int *restrict item_cell, global const uchar *restrict item_cavity,
                          global const real *restrict item_share, global const real *restrict item_faces,
                          global const int *restrict cell_nodes, global const real *restrict position,
                          global const real *restrict lid, global const real *restrict u,
                          global real *restrict gradient, const int cells, const int nodes_stride, const int items,
                          const real h) {
  const int i = item_cell[j];
  if (i < 0) return 0;
  const int member = member_of_item[j / SOLID_BLOCK];
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  const Modes m = cell_modes(u, nodes, nodes_stride, R(0.25) / h);
  real chi[POINTS];
  load_shares(item_share, j, items, chi);
  Modes sum = no_modes();
  real J = 0;
  for (int g = 0; g < POINTS; ++g) {
    const real3 e = point_offset(g);
    const Columns F = deformation(&m, e), K = cofactor(&F);
    J += R(0.25) * chi[g] * dot(F.x, K.x);
    const Columns weighted = {chi[g] * K.x, chi[g] * K.y, chi[g] * K.z};
    add_stress(&sum, &weighted, e);
  }
  store_corners(&sum, h * h / 16, gradient, j, items);
  real total = h * h * h * J;

  real3 x[8];
  const int cavity = member * CAVITIES + item_cavity[j];
  const real3 origin = vload3(2 * cavity, lid), along = vload3(2 * cavity + 1, lid);
  for (int c = 0; c < 8; ++c) {
    const int a = nodes[c];
    x[c] = (real3)(position[a] + u[a], position[a + (size_t)nodes_stride] + u[a + (size_t)nodes_stride],
                   position[a + 2 * (size_t)nodes_stride] + u[a + 2 * (size_t)nodes_stride]) -
           origin;
  }
  for (int face = 0; face < 6; ++face) {
    const real weight = item_faces[j + (size_t)face * items];
    if (!(weight > 0)) continue;
    const int axis = face / 2, p = axis == 0 ? 1 : 0, q = axis == 2 ? 1 : 2;  // axes of the face, p < q
    const int base = face % 2 ? 1 << axis : 0;
    const int corner[4] = {base, base + (1 << p), base + (1 << q), base + (1 << p) + (1 << q)};
    real3 y[4], area[4];
    for (int a = 0; a < 4; ++a) y[a] = x[corner[a]];
    // dxi x deta points along +axis, but for axis y; blood's outward normal points into the cell.
    const real sign = ((axis == 1) == (face % 2 == 0)) ? -weight : weight;
    total += sign * face_areas(y, along, area);
    for (int a = 0; a < 4; ++a)
      for (int d = 0; d < 3; ++d) {
        const real part = d == 0 ? area[a].x : d == 1 ? area[a].y : area[a].z;
        gradient[j + (size_t)(3 * corner[a] + d) * items] += sign * part;
      }
  }
  return total;
}

// The cells' forces (3, slots), mN, each tile's added up by node, and what cavities' volumes depend on: two short launches in one. A work-group (a
// work-item on CPUs) is a tile or a block of items. most: slots of the largest tile. pulls (tiles), where pressures are prescribed: sum of the
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
                         global const real *restrict position, global const real *restrict lid,
                         global real *restrict gradient, global real *restrict volume, local real *restrict scratch,
                         const int cells, const int nodes_stride, const int items, const int slots, const int most,
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
    real mm3 = 0;
#ifndef GPU
    for (int own = 0; own < SOLID_BLOCK; ++own)
#endif
      mm3 += cavity_forces(block * SOLID_BLOCK + own, state, member_of_item, item_cell, item_cavity, item_share, item_faces, cell_nodes,
                           position, lid, u, gradient, cells, nodes_stride, items, h);
#ifdef GPU
    sums_of_block(&mm3, 1, scratch);
    mm3 = scratch[0];
    if (own == 0)
#endif
      volume[block] = mm3;
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
  for (int c = 0; c < 8; ++c) slot[c] = cell_slots[i + (size_t)c * cells];
  real quarter[POINTS];
  load_shares(share, i, cells, quarter);
  local real *at = scratch, *sum = scratch + 3 * most;
  for (int k = own; k < count; k += SOLID_BLOCK) {
    const int a = slot_node[first + k];
    for (int d = 0; d < 3; ++d) {
      at[k + d * most] = u[a + (size_t)d * nodes_stride];
      sum[k + d * most] = 0;
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  const Modes rate = viscous_rate(v, cell_nodes, i, cells, nodes_stride, h);
  const Modes f = cell_forces(i, tile_modes(at, slot, most, R(0.25) / h), rate, quarter, parameters, S, member, region, direction,
                              activation, tension, cells, odd, drive, drive_column, drive_clock);
  const bool tissue = quarter[0] + quarter[1] + quarter[2] + quarter[3] > 0;
  real pull = 0;
  real3 of_corner[8];
  at_corners(&f, -h * h / 16, of_corner);
  // A node is corner c of one cell at most.
#pragma unroll
  for (int c = 0; c < 8; ++c) {
    if (tissue) {
      sum[slot[c]] += of_corner[c].x;
      sum[slot[c] + most] += of_corner[c].y;
      sum[slot[c] + 2 * most] += of_corner[c].z;
#if !BEATS
      pull += dot(of_corner[c], of_corner[c]);
#endif
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  for (int k = own; k < count; k += SOLID_BLOCK)
    for (int d = 0; d < 3; ++d) force[first + k + (size_t)d * slots] = sum[k + d * most];
#if !BEATS
  barrier(CLK_LOCAL_MEM_FENCE);
  sums_of_block(&pull, 1, scratch);
  if (own == 0) pulls[tile] = scratch[0];
#endif
#else
  real at[3 * MOST_SLOTS], sum[3 * MOST_SLOTS], pull = 0;
  for (int k = 0; k < count; ++k) {
    const int a = slot_node[first + k];
    for (int d = 0; d < 3; ++d) {
      at[k + d * MOST_SLOTS] = u[a + (size_t)d * nodes_stride];
      sum[k + d * MOST_SLOTS] = 0;
    }
  }
  for (int i = tile * SOLID_BLOCK; i < (tile + 1) * SOLID_BLOCK; ++i) {
    real quarter[POINTS];
    load_shares(share, i, cells, quarter);
    int slot[8];
    for (int c = 0; c < 8; ++c) slot[c] = cell_slots[i + (size_t)c * cells];
    const Modes rate = viscous_rate(v, cell_nodes, i, cells, nodes_stride, h);
    const Modes f = cell_forces(i, tile_modes(at, slot, MOST_SLOTS, R(0.25) / h), rate, quarter, parameters, S, member, region,
                                direction, activation, tension, cells, odd, drive, drive_column, drive_clock);
    real3 of_corner[8];
    at_corners(&f, -h * h / 16, of_corner);
    for (int c = 0; c < 8; ++c) {
      sum[slot[c]] += of_corner[c].x;
      sum[slot[c] + MOST_SLOTS] += of_corner[c].y;
      sum[slot[c] + 2 * MOST_SLOTS] += of_corner[c].z;
      pull += dot(of_corner[c], of_corner[c]);
    }
  }
  for (int k = 0; k < count; ++k)
    for (int d = 0; d < 3; ++d) force[first + k + (size_t)d * slots] = sum[k + d * MOST_SLOTS];
#if !BEATS
  pulls[tile] = pull;
#endif
#endif
}
