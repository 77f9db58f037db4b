// What is looked at now and then: how fast waves are in cells, which bounds the step, the smallest volumes, energies. The bound:
// solver/README.md, "The step is bounded by what cells share". Needs solid_cells.clh, solid_energy.clh.

// Several waves at once: the bound of a law is that of one (laws.clh).
#define TOGETHER R(1.25)

inline real3 row(const Columns *F, int j) {
  return j == 0 ? (real3)(F->x.x, F->y.x, F->z.x) : j == 1 ? (real3)(F->x.y, F->y.y, F->z.y) : (real3)(F->x.z, F->y.z, F->z.z);
}
inline real3 column_of(const symmetric *S, int i) {
  return i == 0 ? (real3)(S->xx, S->xy, S->xz) : i == 1 ? (real3)(S->xy, S->yy, S->yz) : (real3)(S->xz, S->yz, S->zz);
}

#ifdef LAW_ALONG_AXES
#define TANGENT_STEP R(5e-3)

// Largest stiffness of a wave along axis i of the grid, kPa: of the acoustic tensor A_jk = F_ja dS_ai / dE(e_k (x) e_i) + S_ii delta_jk + kappa K_ji K_ki
// + active f_i^2 delta_jk (Marsden & Hughes 1983, Mathematical Foundations of Elasticity, ch. 3.7), the law's tangent by differences.
inline real wave_stiffness(int i, const Columns *F, symmetric C, symmetric S, real J, real3 f, real3 s, real kappa, real active,
                           global const real *restrict M) {
  const Columns K = cofactor(F);
  const real3 k = i == 0 ? K.x : i == 1 ? K.y : K.z, along = column_of(&S, i);
  const real fi = i == 0 ? f.x : i == 1 ? f.y : f.z, own = i == 0 ? S.xx : i == 1 ? S.yy : S.zz;
  real3 A[3];
  for (int j = 0; j < 3; ++j) {
    const real3 Fj = TANGENT_STEP * row(F, j);
    symmetric moved = C;
    if (i == 0) {
      moved.xx += 2 * Fj.x;
      moved.xy += Fj.y;
      moved.xz += Fj.z;
    } else if (i == 1) {
      moved.xy += Fj.x;
      moved.yy += 2 * Fj.y;
      moved.yz += Fj.z;
    } else {
      moved.xz += Fj.x;
      moved.yz += Fj.y;
      moved.zz += 2 * Fj.z;
    }
    const real kj = j == 0 ? k.x : j == 1 ? k.y : k.z;
    const symmetric next = law_stress(moved, J * sqrt(fmax(sym_determinant(moved) / sym_determinant(C), R(0.0))), f, s, M);
    const real3 change = (column_of(&next, i) - along) / TANGENT_STEP;
    A[j] = apply(F, change) + kappa * kj * k;
  }
  const real diagonal = own + active * fi * fi;
  const symmetric acoustic = {A[0].x + diagonal,
                              A[1].y + diagonal,
                              A[2].z + diagonal,
                              R(0.5) * (A[1].z + A[2].y),
                              R(0.5) * (A[0].z + A[2].x),
                              R(0.5) * (A[0].y + A[1].x)};
  const real largest = sym_largest(acoustic);
  return largest < 0 ? R(0.0) : largest;
}

#endif

// By block of cells (2, blocks): -(smallest mean volume ratio), strain energy (uJ).
#define COLLAPSE_MEASURE 0
#define ENERGY_MEASURE 1
#if ENERGY  // and since the look before the work of active tension, uJ, and now the power of viscosity, uJ/ms
#define ACTIVE_MEASURE 2
#define VISCOUS_MEASURE 3
#define CELL_MEASURES 4
#else
#define CELL_MEASURES 2
#endif
#define CELL_SUMS (CELL_MEASURES - ENERGY_MEASURE)
#if ENERGY && defined(VISCOUS)
// Square of the rate of Green-Lagrange strain, 1/ms2, as viscosity weighs it.
inline real strain_rate2(const Modes *m, const int *nodes, const real *quarter, global const real *restrict v, int stride, real h) {
  const Modes rate = cell_modes(v, nodes, stride, R(0.25) / h);
  real sum = 0;
  for (int g = 0; g < POINTS; ++g) {
    const real3 e = point_offset(g);
    const Columns F = deformation(m, e), D = gradient_at(&rate, e);
    const symmetric E = {dot(F.x, D.x), dot(F.y, D.y), dot(F.z, D.z), R(0.5) * (dot(F.y, D.z) + dot(F.z, D.y)),
                         R(0.5) * (dot(F.x, D.z) + dot(F.z, D.x)), R(0.5) * (dot(F.x, D.y) + dot(F.y, D.x))};
    sum += R(0.25) * fmax(quarter[g], MASS_FLOOR) * sym_contract(E, E);
  }
  return sum;
}
#endif

// bound (cells): of the stiffness, times the mass at a corner per unit of density (solid_bound adds them up at nodes); where some tissue is
// viscous the square of a wave's speed per unit of h, mm2/ms2.
inline void measure_cell(int i, global const real *restrict P, global const int *restrict cell_nodes,
                         global const real *restrict share, global const uchar *restrict region,
                         global const real *restrict direction, global real *restrict tension,
                         global const real *restrict u, global const real *restrict v, global real *restrict bound,
                         int cells, int nodes_stride, real h, real density, real pressure_share, real *measure) {
  real quarter[POINTS];
  load_shares(share, i, quarter);
  if (!(quarter[0] + quarter[1] + quarter[2] + quarter[3] > 0)) return;
  global const real *M = P + material_first[region[i]];
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  const Modes m = cell_modes(u, nodes, nodes_stride, R(0.25) / h);
  const real J = mean_volume_ratio(&m, quarter);
  const real kappa = M[M_bulk_modulus_kPa];
  real energy = 0, weights = 0, stiffness = 0;
#ifdef VISCOUS
  real widest = 0;
#endif
#ifdef LAW_ALONG_AXES
  real3 mean_f = (real3)(0), mean_s = (real3)(0);
#endif
#if TENSION
  const real stretch = fibre_stretch(&m, quarter, direction, i);
  real states[TENSION_STATES + 1];
  for (int k = 0; k < TENSION_STATES; ++k) states[k] = tension[in_tile(i, k, TENSION_FIELDS)];
  const real T = tension[in_tile(i, TENSION_STATES + 1, TENSION_FIELDS)];
  const real active = T + tension_stiffness(states, T, stretch, M);
#endif
  for (int g = 0; g < POINTS; ++g) {
    const Columns F = deformation(&m, point_offset(g)), K = cofactor(&F);
    const real3 f = direction_at(direction, i, g), s = sheet_at(direction, i, g);
    const symmetric C = right_cauchy_green(F.x, F.y, F.z);
#ifdef VISCOUS
    widest = fmax(widest, sym_largest(C));
#endif
    const real Jg = dot(F.x, K.x);
#ifdef LAW_ALONG_AXES
    mean_f += f;
    mean_s += s;
#else
    // Of the law, m (x) N alone is bounded, and several act at once.
    const symmetric S = law_stress(C, Jg, f, s, M);
    const real whole = dot(K.x, K.x) + dot(K.y, K.y) + dot(K.z, K.z);
    const real column = fmax(fmax(dot(K.x, K.x), dot(K.y, K.y)), dot(K.z, K.z));
    real here = kappa * (column + pressure_share * (whole - column)) + TOGETHER * law_stiffness(C, Jg, f, s, M) + sqrt(sym_contract(S, S));
#if TENSION
    here += TOGETHER * active * quarter[g] / fmax(quarter[g], MASS_FLOOR);
#endif
    stiffness = here > stiffness || isnan(here) ? here : stiffness;
#endif
    weights += fmax(quarter[g], MASS_FLOOR);
    energy += R(0.25) * fmax(quarter[g], MASS_FLOOR) *
              (law_energy(C, Jg, f, s, M) + law_volume_energy(J, M[M_bulk_modulus_kPa]));
  }
#ifdef LAW_ALONG_AXES
  // The shortest waves of cells together go along the grid's axes, here in the middle of the cell; a cell alone has them all at once, and what is
  // between depends on the surface (solid_waves.cl).
  const Columns F = deformation(&m, (real3)(0));
  const symmetric C = right_cauchy_green(F.x, F.y, F.z);
  const real3 f = normalize(mean_f), s = dot(mean_s, mean_s) > 0 ? normalize(mean_s) : mean_s;
  const real middle = determinant(&F);
  const symmetric S = law_stress(C, middle, f, s, M);
#if TENSION
  const real pulls = active * (quarter[0] + quarter[1] + quarter[2] + quarter[3]) / weights;
#else
  const real pulls = 0;
#endif
  real along = 0, all = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const real of_axis = wave_stiffness(axis, &F, C, S, middle, f, s, kappa, pulls, M);
    along = fmax(along, of_axis);
    all += of_axis;  // what is no number stays one
  }
  stiffness = along + pressure_share * (all - along);
#endif
#ifdef VISCOUS
  // Central differences with the viscous stress of the step before: dt (c^2 dt / h^2 + 2 nu / h^2) <= 1, nu the kinematic viscosity of
  // what moves along F; the step h / speed is the same with speed = nu / h + sqrt(c^2 + (nu / h)^2).
  const real per_h = M[M_viscosity_kPa_ms] * widest / (density * h);
  const real speed = per_h + sqrt(stiffness / density + per_h * per_h);
  bound[i] = speed * speed;
#else
  bound[i] = stiffness * weights * h * h * h / 32;
#endif
  measure[COLLAPSE_MEASURE] = fmax(measure[COLLAPSE_MEASURE], -J);
  measure[ENERGY_MEASURE] += h * h * h * energy;
#if ENERGY && TENSION
  measure[ACTIVE_MEASURE] += R(0.25) * h * h * h * (quarter[0] + quarter[1] + quarter[2] + quarter[3]) * active_work(tension, i);
#endif
#if ENERGY && defined(VISCOUS)
  measure[VISCOUS_MEASURE] += h * h * h * M[M_viscosity_kPa_ms] * strain_rate2(&m, nodes, quarter, v, nodes_stride, h);
#endif
}

kernel void solid_measure(global const real *restrict parameters, global const wide *restrict state,
                          global const ushort *restrict member_of, global const int *restrict cell_nodes,
                          global const real *restrict share, global const uchar *restrict region,
                          global const real *restrict direction, global real *restrict tension,
                          global const real *restrict u, global const real *restrict v, global real *restrict bound,
                          global real *restrict partial, const int cells, const int nodes_stride, const real h) {
#ifdef GPU
  local real scratch[CELL_SUMS * SOLID_BLOCK];
  const int i = get_global_id(0), block = get_group_id(0), blocks = cells / SOLID_BLOCK;
#else
  const int block = get_global_id(0), blocks = cells / SOLID_BLOCK;
#endif
  const int member = member_of[block];
  if (STANDS(state + member * MEMBER_STATE)) return;
  global const real *P = parameters + (size_t)member * PARAMETERS;
  const real density = P[PARAM_mechanics_density_mg_per_mm3], shared = state[member * MEMBER_STATE + PRESSURE_SHARE];
  real measure[CELL_MEASURES] = {-R(1e30)};
#ifndef GPU
  for (int i = block * SOLID_BLOCK; i < (block + 1) * SOLID_BLOCK; ++i)
#endif
    measure_cell(i, P, cell_nodes, share, region, direction, tension, u, v, bound, cells, nodes_stride, h, density, shared,
                 measure);
#ifdef GPU
  measure[COLLAPSE_MEASURE] = largest_of_block(measure[COLLAPSE_MEASURE], scratch);
  sums_of_block(measure + ENERGY_MEASURE, CELL_SUMS, scratch);
  for (int k = 0; k < CELL_SUMS; ++k) measure[ENERGY_MEASURE + k] = scratch[k * SOLID_BLOCK];
  if (get_local_id(0) == 0)
#endif
    for (int k = 0; k < CELL_MEASURES; ++k) partial[block + (size_t)k * blocks] = measure[k];
}

// By block of nodes: largest square of a wave's speed per unit of h, mm2/ms2. The cells' bounds meet in a node in proportion to their mass there,
// because the energy of a motion is a sum over cells and so is its mass; of viscous cells the largest counts.
kernel void solid_bound(global const wide *restrict state, global const ushort *restrict member_of_node,
                        global const int *restrict corners, global const real *restrict inverse_mass,
                        global const real *restrict bound, global real *restrict partial, const int nodes) {
#ifdef GPU
  local real scratch[SOLID_BLOCK];
  const int a = get_global_id(0), block = get_group_id(0);
#else
  const int block = get_global_id(0);
#endif
  if (state[member_of_node[block] * MEMBER_STATE + ENDED] != 0) return;
  real largest = 0;
#ifndef GPU
  for (int a = block * SOLID_BLOCK; a < (block + 1) * SOLID_BLOCK; ++a)
#endif
  {
    real met = 0;
    for (int c = 0; c < 8; ++c) {
      const real of_cell = bound[corners[a + (size_t)c * nodes]];
#ifdef VISCOUS
      met = fmax(met, of_cell);
#else
      met += of_cell * inverse_mass[a];
#endif
    }
    largest = met > largest || isnan(met) ? met : largest;
  }
#ifdef GPU
  largest = largest_of_block(largest, scratch);
  if (get_local_id(0) == 0)
#endif
    partial[block] = largest;
}
