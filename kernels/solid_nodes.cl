// Nodes of the deforming tissue: forces gathered from cells and supports, velocities, displacements.
// Needs solid_reduce.clh, symmetric.clh.

// How a supported node moves, by its springs, dashpots and clamps: supports (18, support): stiffness K (kPa mm), dashpot C
// (kPa mm ms) and the projector Q on what clamps leave free, each xx yy zz yz xz xy.
inline symmetric support_part(global const real *restrict supports, int s, int part, int stride) {
  global const real *p = supports + s + (size_t)(6 * part) * stride;
  const symmetric A = {p[0], p[stride], p[2 * (size_t)stride], p[3 * (size_t)stride], p[4 * (size_t)stride],
                       p[5 * (size_t)stride]};
  return A;
}

// support_of (nodes): place of a node's support, with a bit where a clamp holds it; negative without. Only then is Q other than the identity.
#define CLAMPED (1 << 30)
inline int support_place(int support) { return support & ~CLAMPED; }
inline real3 freed(real3 v, int support, global const real *restrict supports, int stride) {
  return support & CLAMPED ? sym_times(support_part(supports, support_place(support), 2, stride), v) : v;
}

// cavity_of (nodes): place of a node among those of cavities, above it a bit for each cavity that it touches; 0 for others.
#define CAVITY_BITS 28
#define touches_cavity(packed, q) ((packed) >> (CAVITY_BITS + (q)) & 1u)
#define cavity_place(packed) ((int)((packed) & ((1u << CAVITY_BITS) - 1)))

// Velocity that an impulse gives to a node: (m (1 + alpha dt) + dt C + dt^2 K / 4)^-1, clamps projected out. Springs act on the mean
// (u_n-1 + 2 u_n + u_n+1) / 4 (Newmark 1959, J. Eng. Mech. Div. 85(3):67, beta = 1/4): of second order, without damping, and no spring is
// too stiff for the step.
inline real3 response(real3 impulse, real inverse_mass, real growth, real dt, int support,
                      global const real *restrict supports, int support_stride) {
  if (support < 0) return inverse_mass / growth * impulse;
  const int s = support_place(support);
  const symmetric K = support_part(supports, s, 0, support_stride);
  const symmetric C = sym_fma(R(0.25) * dt, K, support_part(supports, s, 1, support_stride));
  const real k = inverse_mass * dt;
  const symmetric A = {growth + k * C.xx, growth + k * C.yy, growth + k * C.zz, k * C.yz, k * C.xz, k * C.xy};
  const real3 free_impulse = inverse_mass * freed(impulse, support, supports, support_stride);
  return freed(sym_times(sym_cofactor(A), free_impulse) / sym_determinant(A), support, supports, support_stride);
}

// Sums by block of nodes: kinetic energy (of beating hearts only where `sampled`, as that of springs), squares of free forces and of the pressures' forces, energy of springs, r_q = g_q . v*, then
// s_qr = g_q . response(g_r) for q <= r.
// FREE_SUM and LOADED_SUM stand where pressures are prescribed.
#define KINETIC_SUM 0
#define SPRING_SUM 1
#if BEATS
#define RATE_SUM 2
#else
#define FREE_SUM 2
#define LOADED_SUM 3
#define RATE_SUM 4
#endif
#define COMPLIANCE_SUM (RATE_SUM + CAVITIES)
#define NODE_SUMS (COMPLIANCE_SUM + CAVITIES * (CAVITIES + 1) / 2)

// What a node's step needs at once, before anything is known of its member: a GPU waits for all of it together.
typedef struct {
  real inverse_mass;
  int first_slot, end_slot, support;
  real3 velocity;
} node_step;
inline node_step load_node(int a, global const int *restrict first_slot, global const real *restrict inverse_mass,
                           global const int *restrict support_of, global const real *restrict v, int nodes) {
  const node_step n = {inverse_mass[a],
                       first_slot[a],
                       first_slot[a + 1],
                       support_of[a],
                       (real3)(v[a], v[a + (size_t)nodes], v[a + 2 * (size_t)nodes])};
  return n;
}

// Adds up what tiles have stored (3, slots) for a node: slots_of from `begin` up to `end`.
inline real3 gathered(int begin, int end, global const int *restrict slots_of, global const real *restrict field, int slots) {
  real3 sum = (real3)(0);
#ifdef GPU
  // Places first, then what is there: two waits, not two for each.
  int at[8];
#pragma unroll
  for (int k = 0; k < 8; ++k) at[k] = begin + k < end ? slots_of[begin + k] : -1;
#pragma unroll
  for (int k = 0; k < 8; ++k)
    if (at[k] >= 0) sum += (real3)(field[at[k]], field[at[k] + (size_t)slots], field[at[k] + 2 * (size_t)slots]);
#else
  for (int k = begin; k < end; ++k) {
    const int at = slots_of[k];
    sum += (real3)(field[at], field[at + (size_t)slots], field[at + 2 * (size_t)slots]);
  }
#endif
  return sum;
}

// One node of solid_predict. packed: its cavities, 0 without.
inline void predict_node(int a, const node_step n, uint packed, bool touches, global const wide *restrict S, bool sampled,
                         global const int *restrict node_slots, global const real *restrict supports,
                         global const int *restrict cavity_first, global const int *restrict cavity_slots,
                         global const real *restrict force, global const real *restrict gradient,
                         global real *restrict cavity_gradient, global real *restrict u, global real *restrict v, int slots, int nodes,
                         int support_stride, int gradient_slots, int cavity_nodes, int odd, real *sums) {
  const real inverse = n.inverse_mass;
  if (!(inverse > 0)) return;
  const int s = n.support;
  const real3 old = n.velocity;
  const real dt = S[STEP + odd], growth = 1 + (real)S[DAMPING] * dt;
  const bool halt = S[HALT] != 0, moves = BEATS && !touches;  // moves: no pressure is to come
  real3 displacement = (real3)(0);
  if (moves || s >= 0) displacement = (real3)(u[a], u[a + (size_t)nodes], u[a + 2 * (size_t)nodes]);
#if CAVITIES > 0
  real3 g[CAVITIES];
  for (int q = 0; q < CAVITIES; ++q)
    if (touches_cavity(packed, q)) {
      const int place = q * cavity_nodes + cavity_place(packed);
      g[q] = gathered(cavity_first[place], cavity_first[place + 1], cavity_slots, gradient, gradient_slots);
    } else {
      g[q] = (real3)(0);
    }
#endif
  real3 f = gathered(n.first_slot, n.end_slot, node_slots, force, slots);
  real3 of_springs = (real3)(0);  // dt^2 K / 4 times the velocity before
  if (s >= 0) {
    const symmetric K = support_part(supports, support_place(s), 0, support_stride);
    const real3 spring = sym_times(K, displacement);
    f -= spring;
    if (!halt) of_springs = R(0.25) * dt * dt * sym_times(K, old);
    if (sampled) sums[SPRING_SUM] += R(0.5) * dot(spring, displacement);
  }
  // From rest a leapfrog starts with half an impulse: with a whole one, halting often amplifies the fastest modes.
  const real3 quenched = halt ? (real3)(0) : old;
  const real impulse = halt ? R(0.5) * dt : dt;
  const real3 next = response(quenched / inverse + of_springs + impulse * f, inverse, growth, dt, s, supports, support_stride);
  v[a] = next.x;
  v[a + (size_t)nodes] = next.y;
  v[a + 2 * (size_t)nodes] = next.z;
  if (moves) {
    u[a] = displacement.x + dt * next.x;
    u[a + (size_t)nodes] = displacement.y + dt * next.y;
    u[a + 2 * (size_t)nodes] = displacement.z + dt * next.z;
  }
  if (sampled) sums[KINETIC_SUM] += R(0.5) / inverse * dot(quenched, quenched);
  real3 loads = (real3)(0);
#if CAVITIES > 0
  if (packed != 0) {
    real3 moved[CAVITIES];
    for (int q = 0; q < CAVITIES; ++q) {
      moved[q] = (real3)(0);
      if (!touches_cavity(packed, q)) continue;
      const size_t to = cavity_place(packed) + (size_t)(3 * q) * cavity_nodes;
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
#if !BEATS
  real3 free_force = f + loads;
  if (s >= 0) {
    free_force = freed(free_force, s, supports, support_stride);
    loads = freed(loads, s, supports, support_stride);
  }
  sums[FREE_SUM] += dot(free_force, free_force);
  sums[LOADED_SUM] += dot(loads, loads);
#endif
}

// Velocities without the cavities' pressures, in place; of a beating heart, where no cavity is near, displacements too. sums (NODE_SUMS, blocks).
kernel void solid_predict(global const wide *restrict state, global const ushort *restrict member_of_node,
                          global const int *restrict first_slot, global const int *restrict node_slots,
                          global const real *restrict inverse_mass, global const int *restrict support_of,
                          global const real *restrict supports, global const uchar *restrict cavity_block,
                          global const uint *restrict cavity_of, global const int *restrict cavity_first,
                          global const int *restrict cavity_slots, global const real *restrict force, global const real *restrict gradient,
                          global real *restrict cavity_gradient, global real *restrict u,
                          global real *restrict v, global real *restrict partial, const int slots, const int nodes,
                          const int support_stride, const int gradient_slots, const int cavity_nodes, const int odd,
                          const int measured) {
#ifdef GPU
  local real scratch[NODE_SUMS * SOLID_BLOCK];
  const int a = get_global_id(0), block = get_group_id(0), blocks = nodes / SOLID_BLOCK;
  const node_step node = load_node(a, first_slot, inverse_mass, support_of, v, nodes);
#else
  const int block = get_global_id(0), blocks = nodes / SOLID_BLOCK;
#endif
  const bool touches = cavity_block[block] != 0;
  global const wide *S = state + member_of_node[block] * MEMBER_STATE;
  if (STANDS(S)) return;
  // Nobody asks for those of cavities elsewhere.
  const bool sampled = !BEATS || measured;
  const int begin = sampled ? 0 : RATE_SUM, count = (touches ? NODE_SUMS : RATE_SUM) - begin;
  real sums[NODE_SUMS];
  for (int k = 0; k < NODE_SUMS; ++k) sums[k] = 0;
#ifndef GPU
  for (int a = block * SOLID_BLOCK; a < (block + 1) * SOLID_BLOCK; ++a) {
    const node_step node = load_node(a, first_slot, inverse_mass, support_of, v, nodes);
#endif
    predict_node(a, node, touches ? cavity_of[a] : 0, touches, S, sampled, node_slots, supports, cavity_first, cavity_slots, force,
                 gradient, cavity_gradient, u, v, slots, nodes, support_stride, gradient_slots, cavity_nodes, odd, sums);
#ifndef GPU
  }
#endif
#ifdef GPU
  if (count <= 0) return;
  sums_of_block(sums + begin, count, scratch);
  if (get_local_id(0) < count)
    partial[block + (size_t)(begin + get_local_id(0)) * blocks] = scratch[get_local_id(0) * SOLID_BLOCK];
#else
  for (int k = begin; k < begin + count; ++k) partial[block + (size_t)k * blocks] = sums[k];
#endif
}

// Adds the pressures' impulses and moves the nodes of `moving` blocks: those that solid_predict did not.
kernel void solid_move(global const int *restrict moving, global const wide *restrict state, global const ushort *restrict member_of_node,
                       global const real *restrict inverse_mass, global const int *restrict support_of,
                       global const real *restrict supports, global const uchar *restrict cavity_block,
                       global const uint *restrict cavity_of,
                       global const real *restrict cavity_gradient, global real *restrict u, global real *restrict v,
                       const int nodes, const int support_stride, const int cavity_nodes, const int odd) {
  const int block = moving[get_group_id(0)], a = block * SOLID_BLOCK + get_local_id(0);
  const real inverse = inverse_mass[a];
  global const wide *S = state + member_of_node[block] * MEMBER_STATE;
  if (!(inverse > 0) || S[ENDED] != 0) return;
  const real dt = S[STEP + odd];
  real3 velocity = (real3)(v[a], v[a + (size_t)nodes], v[a + 2 * (size_t)nodes]);
#if CAVITIES > 0
  const uint packed = cavity_block[block] != 0 ? cavity_of[a] : 0;
  if (packed != 0) {
    const int j = cavity_place(packed);
    real3 f = (real3)(0);
    for (int q = 0; q < CAVITIES; ++q) {
      if (!touches_cavity(packed, q)) continue;
      const size_t at = j + (size_t)(3 * q) * cavity_nodes;
      f += (real)S[FIRST_PRESSURE + q] *
           (real3)(cavity_gradient[at], cavity_gradient[at + cavity_nodes], cavity_gradient[at + 2 * (size_t)cavity_nodes]);
    }
    velocity += response((S[HALTED] != 0 ? R(0.5) * dt : dt) * f, inverse, 1 + (real)S[STEP_DAMPING] * dt, dt, support_of[a], supports, support_stride);
    v[a] = velocity.x;
    v[a + (size_t)nodes] = velocity.y;
    v[a + 2 * (size_t)nodes] = velocity.z;
  }
#endif
  u[a] += dt * velocity.x;
  u[a + (size_t)nodes] += dt * velocity.y;
  u[a + 2 * (size_t)nodes] += dt * velocity.z;
}

