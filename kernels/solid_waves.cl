// The fastest mode of a member's tissue at rest, once: Chebyshev iteration (Saad 2011, Numerical Methods for Large Eigenvalue Problems, ch. 7.4) on
// M^-1 K, K the derivative of the cells' forces, taken by differences. Cells share their nodes with others of another sign, so that the
// mean pressure's stiffness of all is far below that of one cell alone (5.4 against 12 kappa / (rho h^2) in a heart): by how much depends
// on the cut cells, and is what solid_measure takes from here. Springs are implicit and left out. Needs solid_nodes.cl, solid_cells.clh.

// Largest displacement of the mode, in cells.
#define WAVE_AMPLITUDE R(0.01)
// Modes below this share of the last eigenvalue are held, those above grow.
#define WAVE_EDGE R(0.95)
// Sums by block of nodes: w M y and w M w with y = M^-1 K w, and the largest component of the next w.
#define WAVE_WORK 0
#define WAVE_MASS 1
#define WAVE_LARGEST 2
#define WAVE_SUMS 3
// The iteration comes from below: what the square of the frequency is taken larger by.
#define WAVE_MARGIN R(1.05)

// A start without order: numbers in [-1, 1) by a node's place among its member's (PCG hash: Jarzynski & Olano 2020, J. Comput. Graph. Tech. 9(3):20).
inline real wave_number(uint n) {
  const uint state = n * 747796405u + 2891336453u;
  const uint word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
  return (real)((word >> 22) ^ word) * R(4.656612873e-10) - 1;
}

kernel void solid_wave_start(global const ushort *restrict member_of_node, global const int *restrict node_blocks,
                             global wide *restrict state, global real *restrict wave, const int nodes) {
  const int a = get_global_id(0), member = member_of_node[a / SOLID_BLOCK], own = a - node_blocks[member] * SOLID_BLOCK;
  for (int d = 0; d < 3; ++d) wave[a + (size_t)d * nodes] = wave[a + (size_t)(3 + d) * nodes] = wave_number(3 * own + d);
  if (own == 0) state[member * MEMBER_STATE + WAVE_SIZE] = 1;
}

// Forces (8, 3, cells) of cells by displacements `wave`, as a difference.
kernel void solid_wave_cells(global const real *restrict parameters, global const wide *restrict state,
                             global const ushort *restrict member_of, global const int *restrict cell_nodes,
                             global const real *restrict share, global const uchar *restrict region,
                             global const real *restrict direction, global const real *restrict tension,
                             global const real *restrict u, global const real *restrict wave, global real *restrict force,
                             const int cells, const int nodes_stride, const real h) {
  const int i = get_global_id(0);
  real quarter[POINTS];
  load_shares(share, i, quarter);
  if (!(quarter[0] + quarter[1] + quarter[2] + quarter[3] > 0)) return;
  const int member = member_of[i / SOLID_BLOCK];
  global const wide *S = state + member * MEMBER_STATE;
  if (S[ENDED] != 0) return;
  global const real *M = parameters + (size_t)member * PARAMETERS + material_first[region[i]];
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  const Modes m = cell_modes(u, nodes, nodes_stride, R(0.25) / h);
  const real size = WAVE_AMPLITUDE * h / (real)S[WAVE_SIZE];
  const Modes w = cell_modes(wave, nodes, nodes_stride, R(0.25) / h * size);
  const Modes moved = {m.x + w.x, m.y + w.y, m.z + w.z, m.xy + w.xy, m.xz + w.xz, m.yz + w.yz, m.xyz + w.xyz};
  const real kappa = M[M_bulk_modulus_kPa];
  const real pressure = law_pressure(mean_volume_ratio(&m, quarter), kappa);
  const real next_pressure = law_pressure(mean_volume_ratio(&moved, quarter), kappa);
#if TENSION
  real states[TENSION_STATES + 1];
  for (int k = 0; k < TENSION_STATES; ++k) states[k] = tension[in_tile(i, k, TENSION_FIELDS)];
  const real T = tension[in_tile(i, TENSION_STATES + 1, TENSION_FIELDS)];
  const real stretch = fibre_stretch(&m, quarter, direction, i);
  const real next = fibre_stretch(&moved, quarter, direction, i);
  const real slope = tension_stiffness(states, T, stretch, M);
#if TENSION_PER_STRETCH2
  const real next_T = T + slope * stretch * (next - stretch);
#else
  const real next_T = T + slope / stretch * (next - stretch);
#endif
  const real active = tension_per_stretch(T, stretch), next_active = tension_per_stretch(next_T, next);
#else
  const real active = 0, next_active = 0;
#endif
  Modes sum = no_modes();
  for (int g = 0; g < POINTS; ++g) {
    const real3 e = point_offset(g), f = direction_at(direction, i, g), s = sheet_at(direction, i, g);
    const Columns before = deformation(&m, e), after = deformation(&moved, e);
    const real weight = fmax(quarter[g], MASS_FLOOR);
    const Columns P = point_stress(&before, &before, f, s, weight, quarter[g] * active, pressure, M);
    const Columns Q = point_stress(&after, &after, f, s, weight, quarter[g] * next_active, next_pressure, M);
    const Columns change = {Q.x - P.x, Q.y - P.y, Q.z - P.z};
    add_stress(&sum, &change, e);
  }
  store_corners(&sum, h * h / (16 * size), force, i, cells);
}

inline void wave_node(int a, global const wide *S, global const int *restrict corners, global const real *restrict inverse_mass,
                      global const int *restrict support_of, global const real *restrict supports,
                      global const real *restrict force, global real *restrict wave, int cells, int nodes, int support_stride,
                      real *sums) {
  const real inverse = inverse_mass[a];
  if (!(inverse > 0)) return;
  real3 f = (real3)(0);
  for (int c = 0; c < 8; ++c) {
    const size_t at = corners[a + (size_t)c * nodes] + (size_t)(3 * c) * cells;
    f += (real3)(force[at], force[at + cells], force[at + 2 * (size_t)cells]);
  }
  const int s = support_of[a];
  if (s >= 0) f = freed(f, s, supports, support_stride);
  const real3 w = (real3)(wave[a], wave[a + (size_t)nodes], wave[a + 2 * (size_t)nodes]);
  sums[WAVE_WORK] += dot(w, f);
  sums[WAVE_MASS] += dot(w, w) / inverse;
  const real edge = WAVE_EDGE * (real)S[WAVE_RATE2], size = 1 / (real)S[WAVE_SIZE];
  real3 next = size * inverse * f;
  if (edge > 0)
    next = R(4.0) / edge * next - size * (2 * w + (real3)(wave[a + 3 * (size_t)nodes], wave[a + 4 * (size_t)nodes], wave[a + 5 * (size_t)nodes]));
  sums[WAVE_LARGEST] = fmax(sums[WAVE_LARGEST], fmax(fabs(next.x), fmax(fabs(next.y), fabs(next.z))));
  const real3 last = size * w;
  wave[a] = next.x;
  wave[a + (size_t)nodes] = next.y;
  wave[a + 2 * (size_t)nodes] = next.z;
  wave[a + 3 * (size_t)nodes] = last.x;
  wave[a + 4 * (size_t)nodes] = last.y;
  wave[a + 5 * (size_t)nodes] = last.z;
}

// One iteration, in place; wave (2, 3, nodes): this one and the one before. sums (WAVE_SUMS, blocks).
kernel void solid_wave_nodes(global const wide *restrict state, global const ushort *restrict member_of_node,
                             global const int *restrict corners, global const real *restrict inverse_mass,
                             global const int *restrict support_of, global const real *restrict supports,
                             global const real *restrict force, global real *restrict wave, global real *restrict partial,
                             const int cells, const int nodes, const int support_stride) {
#ifdef GPU
  local real scratch[2 * SOLID_BLOCK];
  const int a = get_global_id(0), block = get_group_id(0), blocks = nodes / SOLID_BLOCK;
#else
  const int block = get_global_id(0), blocks = nodes / SOLID_BLOCK;
#endif
  global const wide *S = state + member_of_node[block] * MEMBER_STATE;
  if (S[ENDED] != 0) return;
  real sums[WAVE_SUMS] = {0, 0, 0};
#ifndef GPU
  for (int a = block * SOLID_BLOCK; a < (block + 1) * SOLID_BLOCK; ++a)
#endif
    wave_node(a, S, corners, inverse_mass, support_of, supports, force, wave, cells, nodes, support_stride, sums);
#ifdef GPU
  const real largest = largest_of_block(sums[WAVE_LARGEST], scratch);
  sums_of_block(sums, 2, scratch);
  sums[WAVE_WORK] = scratch[0];
  sums[WAVE_MASS] = scratch[SOLID_BLOCK];
  sums[WAVE_LARGEST] = largest;
  if (get_local_id(0) == 0)
#endif
    for (int k = 0; k < WAVE_SUMS; ++k) partial[block + (size_t)k * blocks] = sums[k];
}

// The mode's frequency, by its Rayleigh quotient, and what follows of it for the mean pressure: it stiffens a cell by kappa (s1 + share (s1 + s2 + s3 -
// s1)), s the squares of the cofactor's principal values, s1 the largest. A wave along one axis has s1 alone, a cell alone all of them.
// One work-group (a work-item on CPUs) is a member.
kernel void solid_wave_member(global const real *restrict parameters, global const real *restrict partial,
                              global const int *restrict node_blocks,
                              global wide *restrict state, const int blocks, const real h) {
  MEMBER_SCRATCH(scratch, 1);
  const int member = own_member(), item = own_item();
  global wide *S = state + member * MEMBER_STATE;
  const int first = node_blocks[member], last = node_blocks[member + 1];
  const wide work = member_sum(partial + (size_t)WAVE_WORK * blocks, first, last, scratch);
  const wide mass = member_sum(partial + (size_t)WAVE_MASS * blocks, first, last, scratch);
  const real largest = member_largest(partial + (size_t)WAVE_LARGEST * blocks, first, last, scratch);
  if (item != 0) return;
  global const real *P = parameters + (size_t)member * PARAMETERS;
  const wide rate2 = work / mass;
  // What is no number is left to solid_measure.
  const bool found = rate2 > 0 && isfinite((real)rate2) && largest > 0 && isfinite(largest);
  S[WAVE_RATE2] = found ? rate2 : 0;
  S[WAVE_SIZE] = found ? largest : 1;
  real kappa = INFINITY;
  for (int r = 0; r < (int)(sizeof(material_first) / sizeof(int)); ++r)
    if (material_first[r] >= 0) kappa = fmin(kappa, P[material_first[r] + M_bulk_modulus_kPa]);
  const wide stiffness = (wide)WAVE_MARGIN * rate2 * h * h / 4 * P[PARAM_mechanics_density_mg_per_mm3];
  S[PRESSURE_SHARE] = found ? clamp((stiffness / kappa - 1) / 2, (wide)0, (wide)1) : 1;
}
