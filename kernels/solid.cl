// Total Lagrangian elastodynamics on cut cells, matrix-free, explicit in time. A step is four launches:
//   solid_forces, cavity_forces   forces of cells on their nodes; how cavities' volumes depend on their nodes
//   solid_predict                 velocities without the cavities' pressures, and sums over nodes by block
//   a member's kernel             solid_load (prescribed pressures) or the coupled circulation: the pressures, the next step
//   solid_move                    velocities with the pressures, displacements
// Element, cut cells, pressure through the cavity's fraction: solver/README.md. The mean-dilatation pressure: Simo, Taylor &
// Pister, Comput. Methods Appl. Mech. Eng. 51 (1985), with one pressure a cell and U = kappa/2 (J - 1)^2.
// Needs solid.clh, symmetric.clh, a law, a tension law (or none) and -D PARAMETERS, MASS_FLOOR.
#if !defined(PARAMETERS) || !defined(MASS_FLOOR)
#error "solid.cl needs PARAMETERS, MASS_FLOOR"
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

inline symmetric right_cauchy_green(const Columns *F) {
  const symmetric C = {dot(F->x, F->x), dot(F->y, F->y), dot(F->z, F->z),
                       dot(F->y, F->z), dot(F->x, F->z), dot(F->x, F->y)};
  return C;
}

inline real3 multiply(symmetric S, real3 v) {
  return (real3)(S.xx * v.x + S.xy * v.y + S.xz * v.z, S.xy * v.x + S.yy * v.y + S.yz * v.z,
                 S.xz * v.x + S.yz * v.y + S.zz * v.z);
}

#ifdef TENSION
// Stretch along the fibres of a cell: root mean square over its points.
inline real fibre_stretch(const Modes *m, global const real *restrict direction, int i, int stride) {
  real sum = 0;
  for (int g = 0; g < POINTS; ++g) {
    const Columns F = deformation(m, point_offset(g));
    const real3 Ff = apply(&F, direction_at(direction, i, stride, g));
    sum += dot(Ff, Ff);
  }
  return sqrt(R(0.25) * sum);
}
#endif

// Forces (8, 3, cells) of cells on their nodes, mN. share (cells): of the cell in tissue, 0 in padding. direction (points, 3,
// cells), with sheets (2, points, 3, cells). activation (cells): ms, negative without. tension (1 + TENSION_STATES, cells): the
// law's states and the stretch of the step before.
kernel void solid_forces(global const real *restrict parameters, global const wide *restrict state,
                         global const ushort *restrict member_of, global const int *restrict cell_nodes,
                         global const real *restrict share, global const uchar *restrict region,
                         global const real *restrict direction, global const real *restrict activation,
                         global real *restrict tension, global const real *restrict u,
                         global const real *restrict v, global real *restrict force, const int cells,
                         const int nodes_stride, const real h, const int odd) {
  const int i = get_global_id(0);
  real quarter[POINTS];
  load_shares(share, i, cells, quarter);
  const real phi = R(0.25) * (quarter[0] + quarter[1] + quarter[2] + quarter[3]);
  if (!(phi > 0)) return;
  const int member = member_of[i / SOLID_BLOCK];
  global const wide *S = state + member * MEMBER_STATE;
  if (S[ENDED] != 0) return;
  global const real *M = parameters + (size_t)member * PARAMETERS + material_first[region[i]];
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  const Modes m = cell_modes(u, nodes, nodes_stride, R(0.25) / h);
  const real pressure = M[M_bulk_modulus_kPa] * (mean_volume_ratio(&m, quarter) - R(1.0));
#ifdef TENSION
  const real stretch = fibre_stretch(&m, direction, i, cells);
  const real dt = S[STEP + odd];
  real states[TENSION_STATES + 1];
  for (int k = 0; k < TENSION_STATES; ++k) states[k] = tension[i + (size_t)k * cells];
  const real before = tension[i + (size_t)TENSION_STATES * cells];
  const real since = activation[i] < 0 ? R(-1.0) : (real)(S[TIME] - (wide)activation[i]);
  const real T = (real)S[LOAD] *
                 tension_step(states, since, R(0.0), R(0.0), stretch, dt > 0 ? (stretch - before) / dt : R(0.0), dt, M);
  for (int k = 0; k < TENSION_STATES; ++k) tension[i + (size_t)k * cells] = states[k];
  tension[i + (size_t)TENSION_STATES * cells] = stretch;
#endif
#ifdef VISCOUS
  const Modes rate = cell_modes(v, nodes, nodes_stride, R(0.25) / h);
#endif
  Modes sum = {(real3)(0), (real3)(0), (real3)(0), (real3)(0), (real3)(0), (real3)(0), (real3)(0)};
  for (int g = 0; g < POINTS; ++g) {
    const real3 e = point_offset(g);
    const Columns F = deformation(&m, e), K = cofactor(&F);
    const real3 f = direction_at(direction, i, cells, g);
#if LAW_SHEETS
    const real3 s = direction_at(direction, i, cells, POINTS + g);
#else
    const real3 s = (real3)(0);
#endif
    const symmetric C = right_cauchy_green(&F);
    symmetric stress = law_stress(C, dot(F.x, K.x), f, s, M);
#ifdef VISCOUS
    const Columns D = gradient_at(&rate, e);
    const real eta = M[M_viscosity_kPa_ms];
    stress.xx += eta * dot(F.x, D.x);
    stress.yy += eta * dot(F.y, D.y);
    stress.zz += eta * dot(F.z, D.z);
    stress.yz += R(0.5) * eta * (dot(F.y, D.z) + dot(F.z, D.y));
    stress.xz += R(0.5) * eta * (dot(F.x, D.z) + dot(F.z, D.x));
    stress.xy += R(0.5) * eta * (dot(F.x, D.y) + dot(F.y, D.x));
#endif
    const real weight = fmax(quarter[g], MASS_FLOOR);
    Columns P = {
        weight * (F.x * stress.xx + F.y * stress.xy + F.z * stress.xz + pressure * K.x),
        weight * (F.x * stress.xy + F.y * stress.yy + F.z * stress.yz + pressure * K.y),
        weight * (F.x * stress.xz + F.y * stress.yz + F.z * stress.zz + pressure * K.z),
    };
#ifdef TENSION
    real3 along = quarter[g] * T * apply(&F, f);
#if TENSION_PER_STRETCH2
    along /= stretch * stretch;
#endif
    P.x += along * f.x;
    P.y += along * f.y;
    P.z += along * f.z;
#endif
    add_stress(&sum, &P, e);
  }
  store_corners(&sum, -h * h / 16, force, i, cells);
}

// Area of a face by its corners, (integral of N_a n) for each; n points as dxi x deta. 2 x 2 Gauss points are exact. Returns the
// integral of x . n.
inline real face_areas(const real3 *x, real3 *area) {
  real flux = 0;
  for (int a = 0; a < 4; ++a) area[a] = (real3)(0);
  for (int g = 0; g < 4; ++g) {
    const real s = R(0.5) + (g & 1 ? R(0.5) : R(-0.5)) * GAUSS, t = R(0.5) + (g & 2 ? R(0.5) : R(-0.5)) * GAUSS;
    const real weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    const real3 n = R(0.25) * cross((1 - t) * (x[1] - x[0]) + t * (x[3] - x[2]), (1 - s) * (x[2] - x[0]) + s * (x[3] - x[1]));
    for (int a = 0; a < 4; ++a) area[a] += weight[a] * n;
    flux += dot(weight[0] * x[0] + weight[1] * x[1] + weight[2] * x[2] + weight[3] * x[3], n);
  }
  return flux;
}

// What a cell of tissue adds to a cavity: its own blood, share chi of the cell, and the faces behind which blood alone
// lies, each weighted. gradient (8, 3, items): derivative of the cavity's volume by the node's place, mm2. volume (items): mm3; the
// faces' part is that of the cone over `lid` (members, CAVITIES, 3), a point of the plane in which the cavity is cut open.
// item_faces (6, items): -x +x -y +y -z +z.
kernel void cavity_forces(global const wide *restrict state, global const ushort *restrict member_of_item,
                          global const int *restrict item_cell, global const uchar *restrict item_cavity,
                          global const real *restrict item_share, global const real *restrict item_faces,
                          global const int *restrict cell_nodes, global const real *restrict position,
                          global const real *restrict lid, global const real *restrict u,
                          global real *restrict gradient, global real *restrict volume, const int cells,
                          const int nodes_stride, const int items, const real h) {
  const int j = get_global_id(0), i = item_cell[j];
  if (i < 0) return;
  const int member = member_of_item[j / SOLID_BLOCK];
  if (state[member * MEMBER_STATE + ENDED] != 0) return;
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  const Modes m = cell_modes(u, nodes, nodes_stride, R(0.25) / h);
  real chi[POINTS];
  load_shares(item_share, j, items, chi);
  Modes sum = {(real3)(0), (real3)(0), (real3)(0), (real3)(0), (real3)(0), (real3)(0), (real3)(0)};
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
  const real3 origin = vload3(member * CAVITIES + item_cavity[j], lid);
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
    total += sign * face_areas(y, area) / 3;
    for (int a = 0; a < 4; ++a)
      for (int d = 0; d < 3; ++d) {
        const real part = d == 0 ? area[a].x : d == 1 ? area[a].y : area[a].z;
        gradient[j + (size_t)(3 * corner[a] + d) * items] += sign * part;
      }
  }
  volume[j] = total;
}

#ifdef GPU
inline real sum_of_block(real x, local real *scratch) {
  const int item = get_local_id(0);
  scratch[item] = x;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int n = SOLID_BLOCK / 2; n > 0; n /= 2) {
    if (item < n) scratch[item] += scratch[item + n];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  const real total = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
  return total;
}
inline real largest_of_block(real x, local real *scratch) {
  const int item = get_local_id(0);
  scratch[item] = x;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int n = SOLID_BLOCK / 2; n > 0; n /= 2) {
    if (item < n) scratch[item] = fmax(scratch[item], scratch[item + n]);
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  const real total = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
  return total;
}
#endif

// How a supported node moves, by its springs, dashpots and clamps: supports (18, support): stiffness K (kPa mm), dashpot C
// (kPa mm ms) and the projector Q on what clamps leave free, each xx yy zz yz xz xy.
inline symmetric support_part(global const real *restrict supports, int s, int part, int stride) {
  global const real *p = supports + s + (size_t)(6 * part) * stride;
  const symmetric A = {p[0], p[stride], p[2 * (size_t)stride], p[3 * (size_t)stride], p[4 * (size_t)stride],
                       p[5 * (size_t)stride]};
  return A;
}

// Solves A x = b for a symmetric positive matrix.
inline real3 solve_symmetric(symmetric A, real3 b) {
  const real3 r0 = (real3)(A.xx, A.xy, A.xz), r1 = (real3)(A.xy, A.yy, A.yz), r2 = (real3)(A.xz, A.yz, A.zz);
  const real3 c0 = cross(r1, r2), c1 = cross(r2, r0), c2 = cross(r0, r1);
  return (c0 * b.x + c1 * b.y + c2 * b.z) / dot(r0, c0);
}

// Velocity that an impulse gives to a node: (m (1 + alpha dt) + dt C)^-1, clamps projected out.
inline real3 response(real3 impulse, real inverse_mass, real growth, real dt, int support,
                      global const real *restrict supports, int support_stride) {
  if (support < 0) return inverse_mass / growth * impulse;
  const symmetric C = support_part(supports, support, 1, support_stride), Q = support_part(supports, support, 2, support_stride);
  const real k = inverse_mass * dt;
  const symmetric A = {growth + k * C.xx, growth + k * C.yy, growth + k * C.zz, k * C.yz, k * C.xz, k * C.xy};
  return multiply(Q, solve_symmetric(A, inverse_mass * multiply(Q, impulse)));
}

// Sums by block of nodes: kinetic energy, squares of free forces and of the pressures' forces, energy of springs, r_q = g_q . v*, then
// s_qr = g_q . response(g_r) for q <= r.
#define KINETIC_SUM 0
#define FREE_SUM 1
#define LOADED_SUM 2
#define SPRING_SUM 3
#define RATE_SUM 4
#define COMPLIANCE_SUM (RATE_SUM + CAVITIES)
#define NODE_SUMS (COMPLIANCE_SUM + CAVITIES * (CAVITIES + 1) / 2)

// One node of solid_predict.
inline void predict_node(int a, global const wide *restrict S, global const int *restrict corners,
                         global const real *restrict inverse_mass, global const int *restrict support_of,
                         global const real *restrict supports, global const int *restrict cavity_of,
                         global const int *restrict cavity_corners, global const real *restrict force,
                         global const real *restrict gradient, global real *restrict cavity_gradient,
                         global const real *restrict u, global real *restrict v, int cells, int nodes, int support_stride,
                         int items, int cavity_nodes, int odd, real *sums) {
  const real inverse = inverse_mass[a];
  if (!(inverse > 0)) return;
  const real dt = S[STEP + odd], growth = 1 + (real)S[DAMPING] * dt;
  real3 f = (real3)(0);
  for (int c = 0; c < 8; ++c) {
    const size_t at = corners[a + (size_t)c * nodes] + (size_t)(3 * c) * cells;
    f += (real3)(force[at], force[at + cells], force[at + 2 * (size_t)cells]);
  }
  const int s = support_of[a], j = cavity_of[a];
  real3 Q_free = (real3)(1);
  if (s >= 0) {
    const real3 place = (real3)(u[a], u[a + (size_t)nodes], u[a + 2 * (size_t)nodes]);
    const real3 spring = multiply(support_part(supports, s, 0, support_stride), place);
    f -= spring;
    sums[SPRING_SUM] += R(0.5) * dot(spring, place);
  }
  const real3 old = (real3)(v[a], v[a + (size_t)nodes], v[a + 2 * (size_t)nodes]);
  // From rest a leapfrog starts with half an impulse: with a whole one, halting often amplifies the fastest modes.
  const bool halt = S[QUENCH] != 0;
  const real3 quenched = halt ? (real3)(0) : old;
  const real impulse = halt ? R(0.5) * dt : dt;
  const real3 next = response(quenched / inverse + impulse * f, inverse, growth, dt, s, supports, support_stride);
  v[a] = next.x;
  v[a + (size_t)nodes] = next.y;
  v[a + 2 * (size_t)nodes] = next.z;
  sums[KINETIC_SUM] += R(0.5) / inverse * dot(quenched, quenched);
  real3 loads = (real3)(0);
#if CAVITIES > 0
  if (j >= 0) {
    real3 g[CAVITIES], moved[CAVITIES];
    for (int q = 0; q < CAVITIES; ++q) {
      g[q] = (real3)(0);
      for (int c = 0; c < 8; ++c) {
        const int item = cavity_corners[j + (size_t)(8 * q + c) * cavity_nodes];
        const size_t at = item + (size_t)(3 * c) * items;
        if (item >= 0) g[q] += (real3)(gradient[at], gradient[at + items], gradient[at + 2 * (size_t)items]);
      }
      const size_t to = j + (size_t)(3 * q) * cavity_nodes;
      cavity_gradient[to] = g[q].x;
      cavity_gradient[to + cavity_nodes] = g[q].y;
      cavity_gradient[to + 2 * (size_t)cavity_nodes] = g[q].z;
      moved[q] = response(g[q], inverse, growth, dt, s, supports, support_stride);
      sums[RATE_SUM + q] += dot(g[q], next);
      loads += (real)S[FIRST_PRESSURE + q] * g[q];
    }
    int place = COMPLIANCE_SUM;
    for (int q = 0; q < CAVITIES; ++q)
      for (int r = q; r < CAVITIES; ++r) sums[place++] += dot(g[q], moved[r]);
  }
#endif
  real3 free_force = f + loads;
  if (s >= 0) {
    const symmetric Q = support_part(supports, s, 2, support_stride);
    free_force = multiply(Q, free_force);
    loads = multiply(Q, loads);
  }
  sums[FREE_SUM] += dot(free_force, free_force);
  sums[LOADED_SUM] += dot(loads, loads);
}

// Velocities without the cavities' pressures, in place; sums (NODE_SUMS, blocks).
kernel void solid_predict(global const wide *restrict state, global const ushort *restrict member_of_node,
                          global const int *restrict corners, global const real *restrict inverse_mass,
                          global const int *restrict support_of, global const real *restrict supports,
                          global const int *restrict cavity_of, global const int *restrict cavity_corners,
                          global const real *restrict force, global const real *restrict gradient,
                          global real *restrict cavity_gradient, global const real *restrict u,
                          global real *restrict v, global real *restrict partial, const int cells, const int nodes,
                          const int support_stride, const int items, const int cavity_nodes, const int odd) {
#ifdef GPU
  local real scratch[SOLID_BLOCK];
  const int a = get_global_id(0), block = get_group_id(0), blocks = nodes / SOLID_BLOCK;
#else
  const int block = get_global_id(0), blocks = nodes / SOLID_BLOCK;
#endif
  global const wide *S = state + member_of_node[block] * MEMBER_STATE;
  if (S[ENDED] != 0) return;
  real sums[NODE_SUMS];
  for (int k = 0; k < NODE_SUMS; ++k) sums[k] = 0;
#ifndef GPU
  for (int a = block * SOLID_BLOCK; a < (block + 1) * SOLID_BLOCK; ++a)
#endif
    predict_node(a, S, corners, inverse_mass, support_of, supports, cavity_of, cavity_corners, force, gradient,
                 cavity_gradient, u, v, cells, nodes, support_stride, items, cavity_nodes, odd, sums);
  for (int k = 0; k < NODE_SUMS; ++k) {
#ifdef GPU
    const real total = sum_of_block(sums[k], scratch);
    if (get_local_id(0) == 0) partial[block + (size_t)k * blocks] = total;
#else
    partial[block + (size_t)k * blocks] = sums[k];
#endif
  }
}

// Adds the pressures' impulses and moves the nodes.
kernel void solid_move(global const wide *restrict state, global const ushort *restrict member_of_node,
                       global const real *restrict inverse_mass, global const int *restrict support_of,
                       global const real *restrict supports, global const int *restrict cavity_of,
                       global const real *restrict cavity_gradient, global real *restrict u, global real *restrict v,
                       const int nodes, const int support_stride, const int cavity_nodes, const int odd) {
  const int a = get_global_id(0);
  const real inverse = inverse_mass[a];
  global const wide *S = state + member_of_node[a / SOLID_BLOCK] * MEMBER_STATE;
  if (!(inverse > 0) || S[ENDED] != 0) return;
  const real dt = S[STEP + odd];
  real3 velocity = (real3)(v[a], v[a + (size_t)nodes], v[a + 2 * (size_t)nodes]);
#if CAVITIES > 0
  const int j = cavity_of[a];
  if (j >= 0) {
    real3 f = (real3)(0);
    for (int q = 0; q < CAVITIES; ++q) {
      const size_t at = j + (size_t)(3 * q) * cavity_nodes;
      f += (real)S[FIRST_PRESSURE + q] *
           (real3)(cavity_gradient[at], cavity_gradient[at + cavity_nodes], cavity_gradient[at + 2 * (size_t)cavity_nodes]);
    }
    velocity += response((S[HALTED] != 0 ? R(0.5) * dt : dt) * f, inverse, 1 + (real)S[DAMPING] * dt, dt, support_of[a], supports, support_stride);
    v[a] = velocity.x;
    v[a + (size_t)nodes] = velocity.y;
    v[a + 2 * (size_t)nodes] = velocity.z;
  }
#endif
  u[a] += dt * velocity.x;
  u[a + (size_t)nodes] += dt * velocity.y;
  u[a + 2 * (size_t)nodes] += dt * velocity.z;
}

// Largest eigenvalue of a symmetric matrix (trigonometric form; Smith, Commun. ACM 4, 168, 1961).
inline real largest_eigenvalue(symmetric A) {
  const real mean = (A.xx + A.yy + A.zz) / 3;
  const real off = A.yz * A.yz + A.xz * A.xz + A.xy * A.xy;
  const real3 d = (real3)(A.xx, A.yy, A.zz) - mean;
  const real p2 = dot(d, d) + 2 * off;
  if (!(p2 > R(1e-12) * mean * mean)) return mean;
  const real p = sqrt(p2 / 6);
  const real det = d.x * (d.y * d.z - A.yz * A.yz) - A.xy * (A.xy * d.z - A.yz * A.xz) + A.xz * (A.xy * A.yz - d.y * A.xz);
  return mean + 2 * p * cos(acos(clamp(det / (2 * p * p * p), R(-1.0), R(1.0))) / 3);
}
inline symmetric cofactor_symmetric(symmetric A) {
  const symmetric K = {A.yy * A.zz - A.yz * A.yz, A.xx * A.zz - A.xz * A.xz, A.xx * A.yy - A.xy * A.xy,
                       A.xy * A.xz - A.xx * A.yz, A.xy * A.yz - A.yy * A.xz, A.yz * A.xz - A.zz * A.xy};
  return K;
}

// By block of cells (3, blocks): largest square of a wave's speed per unit of h (mm2/ms2), -(smallest mean volume ratio), strain
// energy (uJ).
#define SPEED_MEASURE 0
#define COLLAPSE_MEASURE 1
#define ENERGY_MEASURE 2
#define CELL_MEASURES 3
inline void measure_cell(int i, global const real *restrict P, global const int *restrict cell_nodes,
                         global const real *restrict share, global const uchar *restrict region,
                         global const real *restrict direction, global const real *restrict u, int cells, int nodes_stride,
                         real h, real density, real *measure) {
  real quarter[POINTS];
  load_shares(share, i, cells, quarter);
  if (!(quarter[0] + quarter[1] + quarter[2] + quarter[3] > 0)) return;
  global const real *M = P + material_first[region[i]];
  int nodes[8];
  load_nodes(cell_nodes, i, cells, nodes);
  const Modes m = cell_modes(u, nodes, nodes_stride, R(0.25) / h);
  const real J = mean_volume_ratio(&m, quarter);
  real speed2 = 0, energy = 0;
  for (int g = 0; g < POINTS; ++g) {
    const Columns F = deformation(&m, point_offset(g)), K = cofactor(&F);
    const real3 f = direction_at(direction, i, cells, g);
#if LAW_SHEETS
    const real3 s = direction_at(direction, i, cells, POINTS + g);
#else
    const real3 s = (real3)(0);
#endif
    const symmetric C = right_cauchy_green(&F);
    const real Jg = dot(F.x, K.x);
    const symmetric S = law_stress(C, Jg, f, s, M);
    // Largest eigenvalues by Frobenius norms: the cofactor's, and the stress's geometric stiffness.
    const real bulk = M[M_bulk_modulus_kPa] * largest_eigenvalue(cofactor_symmetric(C));
    const real geometric =
        sqrt(S.xx * S.xx + S.yy * S.yy + S.zz * S.zz + 2 * (S.yz * S.yz + S.xz * S.xz + S.xy * S.xy));
    speed2 = fmax(speed2, (bulk + largest_eigenvalue(C) * law_stiffness(C, Jg, f, s, M) + geometric) / density);
    energy += R(0.25) * fmax(quarter[g], MASS_FLOOR) *
              (law_energy(C, Jg, f, s, M) + R(0.5) * M[M_bulk_modulus_kPa] * (J - 1) * (J - 1));
  }
  measure[SPEED_MEASURE] = fmax(measure[SPEED_MEASURE], speed2);
  measure[COLLAPSE_MEASURE] = fmax(measure[COLLAPSE_MEASURE], -J);
  measure[ENERGY_MEASURE] += h * h * h * energy;
}

kernel void solid_measure(global const real *restrict parameters, global const wide *restrict state,
                          global const ushort *restrict member_of, global const int *restrict cell_nodes,
                          global const real *restrict share, global const uchar *restrict region,
                          global const real *restrict direction, global const real *restrict u,
                          global real *restrict partial, const int cells, const int nodes_stride, const real h) {
#ifdef GPU
  local real scratch[SOLID_BLOCK];
  const int i = get_global_id(0), block = get_group_id(0), blocks = cells / SOLID_BLOCK;
#else
  const int block = get_global_id(0), blocks = cells / SOLID_BLOCK;
#endif
  const int member = member_of[block];
  if (state[member * MEMBER_STATE + ENDED] != 0) return;
  global const real *P = parameters + (size_t)member * PARAMETERS;
  const real density = P[PARAM_mechanics_density_mg_per_mm3];
  real measure[CELL_MEASURES] = {0, -R(1e30), 0};
#ifndef GPU
  for (int i = block * SOLID_BLOCK; i < (block + 1) * SOLID_BLOCK; ++i)
#endif
    measure_cell(i, P, cell_nodes, share, region, direction, u, cells, nodes_stride, h, density, measure);
#ifdef GPU
  measure[SPEED_MEASURE] = largest_of_block(measure[SPEED_MEASURE], scratch);
  measure[COLLAPSE_MEASURE] = largest_of_block(measure[COLLAPSE_MEASURE], scratch);
  measure[ENERGY_MEASURE] = sum_of_block(measure[ENERGY_MEASURE], scratch);
  if (get_local_id(0) == 0)
#endif
    for (int k = 0; k < CELL_MEASURES; ++k) partial[block + (size_t)k * blocks] = measure[k];
}

// Sum or largest of quantity k of a member's blocks, in a fixed order; complete in item 0.
inline wide member_sum(global const real *restrict partial, int first, int last, local wide *scratch) {
#ifdef GPU
  const int item = get_local_id(0), items = MEMBER_GROUP;
#else
  const int item = 0, items = 1;
#endif
  wide total = 0;
  for (int block = first + item; block < last; block += items) total += partial[block];
#ifdef GPU
  scratch[item] = total;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int n = MEMBER_GROUP / 2; n > 0; n /= 2) {
    if (item < n) scratch[item] += scratch[item + n];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  total = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
#endif
  return total;
}
inline real member_largest(global const real *restrict partial, int first, int last, local wide *scratch) {
#ifdef GPU
  const int item = get_local_id(0), items = MEMBER_GROUP;
#else
  const int item = 0, items = 1;
#endif
  real largest = -R(1e30);
  for (int block = first + item; block < last; block += items) largest = partial[block] > largest || isnan(partial[block]) ? partial[block] : largest;
#ifdef GPU
  scratch[item] = largest;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int n = MEMBER_GROUP / 2; n > 0; n /= 2) {
    if (item < n && (scratch[item + n] > scratch[item] || isnan(scratch[item + n]))) scratch[item] = scratch[item + n];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  largest = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
#endif
  return largest;
}

// How a member's mechanics ended.
#define RUNNING 0
#define FINISHED 1
#define INVERTED 2
#define RUNAWAY 3
#define STALLED 4  // the step has become too small a share of the first

#define FEWEST_STEPS_TO_HALT 5

// Takes what solid_measure found into the state: the largest step, failures.
inline void take_measures(global wide *S, real speed2, real collapse, wide energy, real h, real courant) {
  S[LARGEST_SPEED2] = speed2;
  S[SMALLEST_J] = -collapse;
  S[STRAIN_ENERGY] = energy;
  const wide largest = courant * h / sqrt(speed2);
  S[LARGEST_STEP] = largest;
  if (!(-collapse > R(0.02))) S[ENDED] = INVERTED;
  if (!isfinite(speed2) || !isfinite((real)energy)) S[ENDED] = RUNAWAY;
}

// A member under prescribed pressures: one work-group (a work-item on CPUs) each. node_blocks, cell_blocks, item_blocks
// (members + 1): first blocks of its nodes, cells and, by cavity, items (members * CAVITIES + 1).
// loads: (ramp ms, end ms, tolerance of the residual, 1 when quasi-static). pressures (members, CAVITIES): kPa.
kernel void solid_load(global const real *restrict partial, global const real *restrict measures,
                       global const real *restrict volume, global const int *restrict node_blocks,
                       global const int *restrict cell_blocks, global const int *restrict item_blocks,
                       global const real *restrict pressures, const real4 loads, global wide *restrict state,
                       const int all_node_blocks, const int all_cell_blocks, const int measured, const real h,
                       const real courant, const int odd) {
#ifdef GPU
  local wide scratch[MEMBER_GROUP];
  const int member = get_group_id(0), item = get_local_id(0);
#else
  local wide *scratch = 0;
  const int member = get_global_id(0), item = 0;
#endif
  global wide *S = state + member * MEMBER_STATE;
  if (S[ENDED] != 0) return;
  const int first = node_blocks[member], last = node_blocks[member + 1];
  const wide kinetic = member_sum(partial + (size_t)KINETIC_SUM * all_node_blocks, first, last, scratch);
  const wide free_force = member_sum(partial + (size_t)FREE_SUM * all_node_blocks, first, last, scratch);
  const wide loaded = member_sum(partial + (size_t)LOADED_SUM * all_node_blocks, first, last, scratch);
  wide volumes[CAVITIES + 1];
  for (int q = 0; q < CAVITIES; ++q)
    volumes[q] = member_sum(volume, item_blocks[member * CAVITIES + q] * SOLID_BLOCK,
                            item_blocks[member * CAVITIES + q + 1] * SOLID_BLOCK, scratch);
  const int first_cell = cell_blocks[member], last_cell = cell_blocks[member + 1];
  real speed2 = 0, collapse = 0;
  wide energy = 0;
  if (measured) {
    speed2 = member_largest(measures + (size_t)SPEED_MEASURE * all_cell_blocks, first_cell, last_cell, scratch);
    collapse = member_largest(measures + (size_t)COLLAPSE_MEASURE * all_cell_blocks, first_cell, last_cell, scratch);
    energy = member_sum(measures + (size_t)ENERGY_MEASURE * all_cell_blocks, first_cell, last_cell, scratch);
  }
  if (item != 0) return;
  const wide time = S[TIME], ramp = loads.x, end = loads.y;
  const bool still = loads.w != 0, full = time >= ramp;
  if (measured) take_measures(S, speed2, collapse, energy, h, courant);
  const wide residual = loaded > 0 ? sqrt(free_force / loaded) : 0;
  S[RESIDUAL] = residual;
  S[HALTED] = S[QUENCH];  // of the step under way
  S[SINCE_HALT] += 1;
  S[QUENCH] = still && S[SINCE_HALT] > FEWEST_STEPS_TO_HALT && kinetic < S[KINETIC] ? 1 : 0;
  if (S[QUENCH] != 0) S[SINCE_HALT] = 0;
  S[KINETIC] = S[QUENCH] != 0 ? 0 : kinetic;
  if (still && full && residual < loads.z) S[ENDED] = FINISHED;
  if (!isfinite((real)kinetic) || !isfinite((real)free_force)) S[ENDED] = RUNAWAY;
  const wide dt = S[STEP + odd];
  S[TIME] = time + dt;
  S[LOAD] = S[TIME] < ramp ? S[TIME] / ramp : 1;
  for (int q = 0; q < CAVITIES; ++q) {
    S[FIRST_VOLUME + q] = volumes[q];
    S[FIRST_PRESSURE + q] = S[LOAD] * pressures[member * CAVITIES + q];
  }
  S[STEPS_DONE] += 1;
  S[STEP + 1 - odd] = dt > 0 ? fmin(S[LARGEST_STEP], (wide)1.02 * dt) : S[LARGEST_STEP];
  if (S[TIME] >= end && S[ENDED] == 0) S[ENDED] = still ? STALLED : FINISHED;
}
