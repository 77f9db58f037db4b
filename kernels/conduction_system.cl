// The fast conduction system of the heart on its compact tissue: the subendocardial (Purkinje) layer as a sheet (eikonal.cl)
// along the endocardium, known by the cells within REACH of it; and the places of the nodes and of the early
// sites. Early sites: Durrer et al., Circulation 41 (1970) 899. Needs segments.clh, field_gradient.clh and -D PARAMETERS, TARGETS,
// TARGET_NUMBERS, PARAM_electrophysiology_conduction_system_*.
#if !defined(TARGETS) || !defined(PARAMETERS) || !defined(TARGET_NUMBERS)
#error "conduction_system.cl needs TARGETS, TARGET_NUMBERS and PARAMETERS"
#endif

#define SYSTEM(name) P[JOIN(PARAM_electrophysiology_conduction_system_, name)]
#define LEFT_SHEET 1
#define RIGHT_SHEET 2
// Wide enough for a set of cells without holes at any inclination, also where distances are uncertain, as those from labels.
#define REACH R(1.0)  // in dx
#define RIM R(1.0)    // in dx, how far the row beyond the rim goes

// The way of the wave across the rim of a layer, to a cell that lies beyond it by d.x mm along the surface in the direction `up`
// and d.y mm deep along the normal n, where the layer's wave reaches the whole rim at once: a line source in the metric of fibre f,
//     min over s of |u - s r|,   u = d.x up + d.y n,   r the rim's direction.
inline real way_from_rim(real2 d, real3 up, real3 n, real3 f, real along, real across) {
  const real3 u = d.x * up + d.y * n, r = cross(n, up);
  const real slow = 1 / (across * across), less = 1 / (along * along) - slow;
  const real uu = slow * dot(u, u) + less * dot(u, f) * dot(u, f), ur = slow * dot(u, r) + less * dot(u, f) * dot(r, f);
  const real rr = slow * dot(r, r) + less * dot(r, f) * dot(r, f);
  return sqrt(fmax(uu - ur * ur / rr, R(0.0)));
}

// sheet (stride): LEFT_SHEET, RIGHT_SHEET (with the septum's right side) or 0; speed (stride) mm/ms; depth (stride) ms, the
// wave's way across fibres from the endocardium to the cell, and negative in the row of cells beyond the layer's rim (see
// eikonal.cl); distances (stride) mm, a copy. coordinates (4, stride): transmural, apico-basal, angle, distance
// from the nearest endocardium; velocity (2, stride) along and across fibres, mm/ms; fibre (3, stride).
kernel void fast_layer(global const real *restrict parameters, global const ushort *restrict member_of,
                       global const uchar *restrict tissue_region_of, global const real *restrict coordinates,
                       global const real *restrict velocity, global const real *restrict fibre,
                       global const int *restrict first_cell, global const int *restrict place,
                       global uchar *restrict sheet, global real *restrict speed,
                       global real *restrict depth, global real *restrict distances, const int stride, const real dx,
                       const int grid_cells) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
  const real distance = coordinates[i + 3 * (size_t)stride], along = velocity[i], across = velocity[i + (size_t)stride];
  const real fast = SYSTEM(fast_layer_velocity_mm_per_ms);
  int id = 0;
  real way = R(1e9);
  if ((region == REGION_lv || region == REGION_rv) && fabs(distance) <= REACH * dx && along > 0 && across > 0) {
    const bool left = region == REGION_lv && coordinates[i] <= R(0.5);
    const real top = left ? SYSTEM(lv_fast_layer_height) : SYSTEM(rv_fast_layer_height);
    const real beyond = coordinates[i + (size_t)stride] - top;
    const int own = left ? LEFT_SHEET : RIGHT_SHEET;
    if (beyond <= 0) {
      id = own;
      way = fmax(distance, R(0.0)) / across;
    } else {
      const real3 rise = field_gradient(coordinates + stride, i, first_cell, place, tissue_region_of, dx, grid_cells);
      const real3 across_wall =
          distance_gradient(coordinates + 3 * (size_t)stride, i, first_cell, place, tissue_region_of, dx, grid_cells);
      const real3 n = across_wall / fmax(length(across_wall), R(1e-6));
      const real3 along_surface = rise - dot(rise, n) * n;
      const real slope = length(along_surface), off = beyond / fmax(slope, R(1e-6));  // mm
      if (off <= RIM * dx) {
        const real3 f = (real3)(fibre[i], fibre[i + (size_t)stride], fibre[i + 2 * (size_t)stride]);
        const real2 d = (real2)(off, fmax(distance, R(0.0)));
        id = own;
        way = fmin(off / fast - way_from_rim(d, along_surface / slope, n, f, along, across), R(-1e-3));
      }
    }
  }
  sheet[i] = (uchar)id;
  distances[i] = distance;
  speed[i] = fast;
  depth[i] = way;
}

// Fibres (3, stride) that arrival times go by. Where fibres turn through the wall a wave along it is led by the fastest depth, often
// a surface, while the centre of a cell that the surface passes through lies up to dx/2 within: such cells of the ventricles take the
// fibre at the surface, turned about the wall's normal by the rule of fibres.clh. coordinates as in fast_layer.
kernel void surface_fibres(global const real *restrict parameters, global const ushort *restrict member_of,
                           global const uchar *restrict tissue_region_of, global const real *restrict coordinates,
                           global const real *restrict fibre, global const int *restrict first_cell,
                           global const int *restrict place, global real *restrict turned, const int stride,
                           const real dx, const int grid_cells) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  real3 f = (real3)(fibre[i], fibre[i + (size_t)stride], fibre[i + 2 * (size_t)stride]);
#ifdef PARAM_geometry_fibres_endocardium_deg
  if (region == REGION_lv || region == REGION_rv) {
    global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
    const real u = coordinates[i], side = u < R(0.5) ? 1 : -1;
    const real3 gradient = inward_gradient(coordinates, side, i, first_cell, place, tissue_region_of, dx, grid_cells);
    const real slope = length(gradient), surface = u < R(0.5) ? 0 : 1;
    if (slope > 0 && fabs(u - surface) < R(0.5) * dx * slope) {
      const real turn = radians(P[PARAM_geometry_fibres_epicardium_deg] - P[PARAM_geometry_fibres_endocardium_deg]) * (surface - u);
      f = cos(turn) * f + sin(turn) * cross(gradient / slope, f);
    }
  }
#endif
  turned[i] = f.x;
  turned[i + (size_t)stride] = f.y;
  turned[i + 2 * (size_t)stride] = f.z;
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
                          global const real *restrict depth, global const real *restrict coordinates,
                          global int *restrict nearest, const int stride) {
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
    if (region == NO_REGION || !may_be(kind, region, depth[i] < 0 ? 0 : sheet[i])) continue;
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

// points (rows, 4): the target's own place, near its cell, x, y, z in mm and 1. A node lies inside its cell. A site lies on the
// endocardium at its height and angle: from the cell's centre one step of Newton's method; where that leads far, the centre's foot.
kernel void target_points(global const real *restrict targets, global const int *restrict nearest,
                          const real4 origin_and_spacing, global const int *restrict first_cell,
                          global const int *restrict place, global const uchar *restrict tissue_region_of,
                          global const real *restrict coordinates, global real4 *restrict points, const int stride,
                          const int grid_cells, const int rows) {
  const int row = get_global_id(0);
  if (row >= rows) return;
  global const real *target = targets + (size_t)row * TARGET_NUMBERS;
  const int i = nearest[row];
  const real dx = origin_and_spacing.w;
  real3 p = (real3)(0);
  if (i >= 0) {
    p = cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz, dx);
    if ((int)target[0] == IN_RIGHT_ATRIUM) {
      p += clamp((real3)(target[1], target[2], target[3]) - p, R(-0.5) * dx, R(0.5) * dx);
    } else {
      global const real *height = coordinates + stride, *distance = coordinates + 3 * (size_t)stride;
      const real3 n = distance_gradient(distance, i, first_cell, place, tissue_region_of, dx, grid_cells);
      const real3 rise = field_gradient(height, i, first_cell, place, tissue_region_of, dx, grid_cells);
      const real size = length(n), slope = length(rise);
      if (size > 0 && slope > 0) {
        const real3 a = n / size, b = rise / slope, c = (real3)(-sin(target[2]), cos(target[2]), 0);
        const real off_a = -distance[i] / fmax(size, R(1.0)), off_b = (target[1] - height[i]) / slope, off_c = -dot(c, p);
        const real volume = dot(a, cross(b, c));
        const real3 way = (off_a * cross(b, c) + off_b * cross(c, a) + off_c * cross(a, b)) / volume;
        const bool close = fabs(volume) > R(0.2) && length(way) < 2 * dx;
        p += close ? way : off_a * a;
      }
    }
  }
  points[row] = (real4)(p, 1);
}
