// The fast conduction system of the heart on its compact tissue: the subendocardial (Purkinje) layer as a sheet (eikonal.cl)
// along the endocardium, known by the cells within REACH of it; and the tissue cells nearest to the nodes and to the early
// sites. Early sites: Durrer et al., Circulation 41 (1970) 899. Needs segments.clh and -D PARAMETERS, TARGETS,
// TARGET_NUMBERS, PARAM_electrophysiology_conduction_system_*.
#if !defined(TARGETS) || !defined(PARAMETERS) || !defined(TARGET_NUMBERS)
#error "conduction_system.cl needs TARGETS, TARGET_NUMBERS and PARAMETERS"
#endif

#define SYSTEM(name) P[JOIN(PARAM_electrophysiology_conduction_system_, name)]
#define LEFT_SHEET 1
#define RIGHT_SHEET 2
// Wide enough for a set of cells without holes at any inclination, also where distances are uncertain, as those from labels.
#define REACH R(1.0)  // in dx

// sheet (stride): LEFT_SHEET, RIGHT_SHEET (with the septum's right side) or 0; speed (stride) mm/ms; depth (stride) ms, the
// wave's way across fibres from the endocardium to the cell; distances (stride) mm, a copy. coordinates (4, stride): transmural, apico-basal, angle, distance
// from the nearest endocardium; velocity (2, stride) along and across fibres, mm/ms.
kernel void fast_layer(global const real *restrict parameters, global const ushort *restrict member_of,
                       global const uchar *restrict tissue_region_of, global const real *restrict coordinates,
                       global const real *restrict velocity, global uchar *restrict sheet, global real *restrict speed,
                       global real *restrict depth, global real *restrict distances, const int stride, const real dx) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
  const real distance = coordinates[i + 3 * (size_t)stride], along = velocity[i], across = velocity[i + (size_t)stride];
  int id = 0;
  if ((region == REGION_lv || region == REGION_rv) && fabs(distance) <= REACH * dx && along > 0 && across > 0) {
    const bool left = region == REGION_lv && coordinates[i] <= R(0.5);
    const real top = left ? SYSTEM(lv_fast_layer_height) : SYSTEM(rv_fast_layer_height);
    if (coordinates[i + (size_t)stride] <= top) id = left ? LEFT_SHEET : RIGHT_SHEET;
  }
  sheet[i] = (uchar)id;
  distances[i] = distance;
  speed[i] = SYSTEM(fast_layer_velocity_mm_per_ms);
  depth[i] = id != 0 ? fmax(distance, R(0.0)) / across : R(1e9);
}

// Kinds of targets, the first number of a target's block; then a place.
#define IN_RIGHT_ATRIUM 0         // x, y, z in mm
#define ON_LEFT_ENDOCARDIUM 1     // apico-basal coordinate, angle, length (mm) of the apico-basal coordinate
#define ON_RIGHT_SEPTUM 2
#define ON_RIGHT_FREE_WALL 3

// Whether cell i may be a target's.
inline bool may_be(int kind, int region, int sheet) {
  if (kind == IN_RIGHT_ATRIUM) return region == REGION_ra;
  if (kind == ON_LEFT_ENDOCARDIUM) return sheet == LEFT_SHEET;
  return sheet == RIGHT_SHEET && region == (kind == ON_RIGHT_SEPTUM ? REGION_lv : REGION_rv);
}

// nearest (members, TARGETS): place of the nearest cell, the first of equals; -1 where no cell may be the target's.
// A work-group of GROUP items for each; on CPUs one item. ranges (members + 1): first blocks.
kernel void nearest_cells(global const real *restrict targets, const real4 origin_and_spacing,
                          global const int *restrict first_cell, global const int *restrict ranges,
                          global const uchar *restrict tissue_region_of, global const uchar *restrict sheet,
                          global const real *restrict coordinates, global int *restrict nearest, const int stride) {
#ifdef GPU
  const int row = get_group_id(0), lane = get_local_id(0), lanes = get_local_size(0);
  local real best_distance[BLOCK];
  local int best_cell[BLOCK];
#else
  const int row = get_global_id(0), lane = 0, lanes = 1;
#endif
  const int member = row / TARGETS;
  global const real *target = targets + (size_t)row * TARGET_NUMBERS;
  const int kind = (int)target[0];
  real least = R(1e30);
  int best = -1;
  for (int i = FIRST_CELL + ranges[member] * BLOCK + lane; i < FIRST_CELL + ranges[member + 1] * BLOCK; i += lanes) {
    const int region = tissue_region_of[i];
    if (region == NO_REGION || !may_be(kind, region, sheet[i])) continue;
    const real3 p = cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz,
                                origin_and_spacing.w);
    real distance2;
    if (kind == IN_RIGHT_ATRIUM) {
      const real3 d = p - (real3)(target[1], target[2], target[3]);
      distance2 = dot(d, d);
    } else {
      const real turn = coordinates[i + 2 * (size_t)stride] - target[2];
      const real around = length(p.xy) * (turn - 2 * (real)M_PI_F * round(turn / (2 * (real)M_PI_F)));
      const real up = (coordinates[i + (size_t)stride] - target[1]) * target[3];
      const real beside = coordinates[i + 3 * (size_t)stride];
      distance2 = around * around + up * up + beside * beside;
    }
    if (distance2 < least) {
      least = distance2;
      best = i;
    }
  }
#ifdef GPU
  best_distance[lane] = least;
  best_cell[lane] = best;
  for (int rest = lanes / 2; rest > 0; rest /= 2) {
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < rest) {
      const real other = best_distance[lane + rest];
      const int cell = best_cell[lane + rest];
      if (cell >= 0 && (best_cell[lane] < 0 || other < best_distance[lane] ||
                        (other == best_distance[lane] && cell < best_cell[lane]))) {
        best_distance[lane] = other;
        best_cell[lane] = cell;
      }
    }
  }
  if (lane == 0) nearest[row] = best_cell[0];
#else
  nearest[row] = best;
#endif
}
