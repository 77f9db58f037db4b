// Where and when the waves of eikonal.clh start: points, which need not be cell centres. A front that spreads from a point has
// no second derivative there, and linear interpolation is late by h log h if only one cell is given. So all cells about
// a point get the exact time of a straight way: in a sheet S = start + |foot - point| / v, with the feet of the cells' normals
// on the surface; in tissue T = start + sqrt(d.G d), G the mean metric of both ends, as far as the metric is the same.
//
// Needs segments.clh, field_gradient.clh, eikonal.clh, whose fields they are. A point is x, y, z in mm and 1 where it is given, 0 where the cell's
// centre stands for it.

#define NEAR R(2.0)        // in dx: cells that get the straight way whatever their metric
#define SAME_METRIC R(0.05)
#define SAME_SIDE R(0.7)   // cosine between normals of a sheet that has not folded back

inline real3 centre_of(global const int *first_cell, int i, real4 origin_and_spacing) {
  return cell_centre(first_cell[i / LANES] % (NX * NY * NZ), i % LANES, origin_and_spacing.xyz, origin_and_spacing.w);
}

// Grid coordinates of the cell that holds p, within its member's grid; and its compact place.
inline int place_at(int3 at, int member_grid, global const int *place) {
  const int3 extent = (int3)(NX, NY, NZ);
  if (any(at < 0) || any(at >= extent)) return VOID_CELL;
  const int cell = member_grid + at.x + NX * (at.y + NY * at.z);
  return LANES * place[cell / LANES] + cell % LANES;
}
inline int3 coordinates_of(int cell) {
  return (int3)(cell % NX, cell / NX % NY, cell / (NX * NY) % NZ);
}

// d.(G + other G)/2 d with d in mm.
inline real squared_way(global const real *metric, int i, int j, real3 d, real dx, int stride) {
  real g[6];
  for (int c = 0; c < 6; ++c) g[c] = R(0.5) * (metric[i + c * (size_t)stride] + metric[j + c * (size_t)stride]);
  d /= dx;
  return g[0] * d.x * d.x + g[1] * d.y * d.y + g[2] * d.z * d.z +
         2 * (g[3] * d.x * d.y + g[4] * d.x * d.z + g[5] * d.y * d.z);
}

inline bool same_metric(global const real *metric, int i, int j, int stride) {
  real difference = 0, size = 0;
  for (int c = 0; c < 6; ++c) {
    const real a = metric[i + c * (size_t)stride], b = metric[j + c * (size_t)stride];
    difference += (a - b) * (a - b);
    size += a * a;
  }
  return difference <= SAME_METRIC * SAME_METRIC * size;
}

// When sources fire: at start[k], with a trigger[k] >= 0 that much later than the wave reaches that cell, or a point near
// its centre: there the least of T and the straight way over the cells of its region about it.
kernel void eikonal_trigger(global const int *restrict trigger, global const real4 *restrict trigger_point,
                            global const real *restrict start, global const real *restrict T,
                            global const int *restrict first_cell, global const int *restrict place,
                            global const uchar *restrict region, global const real *restrict metric,
                            const real4 origin_and_spacing, global real *restrict fired, const int stride,
                            const int sources) {
  const int k = get_global_id(0);
  if (k >= sources) return;
  real come = 0;
  if (trigger[k] >= 0) {
    const int i = trigger[k];
    come = T[i];
    if (trigger_point[k].w != 0) {
      const int cell = first_cell[i / LANES] + i % LANES, member_grid = cell - cell % (NX * NY * NZ);
      const int3 at = coordinates_of(cell);
      come = UNREACHED;
      for (int n = 0; n < 125; ++n) {
        const int j = place_at(at + (int3)(n % 5, n / 5 % 5, n / 25) - 2, member_grid, place);
        if (region[j] != region[i] || !(T[j] < UNREACHED)) continue;
        const real3 d = trigger_point[k].xyz - centre_of(first_cell, j, origin_and_spacing);
        come = fmin(come, T[j] + sqrt(squared_way(metric, i, j, d, origin_and_spacing.w, stride)));
      }
    }
  }
  fired[k] = come < UNREACHED ? come + start[k] : UNREACHED;
}

// Whether the straight way from p to cell j stays in the region of j, in cells that conduct.
inline bool in_sight(real3 p, int j, int member_grid, global const int *first_cell, global const int *place,
                     global const uchar *region, global const int *linked, real4 origin_and_spacing) {
  const real3 way = centre_of(first_cell, j, origin_and_spacing) - p;
  const int steps = 2 * (int)ceil(length(way) / origin_and_spacing.w);
  for (int s = 0; s < steps; ++s) {
    const real3 q = (p + way * ((real)s / (real)steps) - origin_and_spacing.xyz) / origin_and_spacing.w;
    const int3 at = (int3)((int)floor(q.x), (int)floor(q.y), (int)floor(q.z));
    const int passed = place_at(at, member_grid, place);
    if (region[passed] != region[j] || linked[passed] == 0) return false;
  }
  return true;
}

// Fires sources first, first + 1, ..., no two of one member: a work-item for each cell within `reach` cells of one along each axis.
// radius in mm.
kernel void eikonal_fire(const int first, global const int *restrict source_cell, global const real4 *restrict point,
                         global const real *restrict fired, global const int *restrict first_cell,
                         global const int *restrict place, global const uchar *restrict region,
                         global const int *restrict linked, global const real *restrict metric, const int with_sheet, global const uchar *restrict sheet,
                         global const real *restrict distance, global const real *restrict sheet_speed,
                         const real4 origin_and_spacing, const real radius, const int reach, global real *restrict correction,
                         global real *restrict T,
                         global real *restrict T_other, global int *restrict changed, const int mark,
                         global int *restrict last_change, const int stride, const int grid_cells, const int items) {
  const int item = get_global_id(0);
  if (item >= items) return;
  const int across = 2 * reach + 1, k = first + item / (across * across * across), n = item % (across * across * across);
  if (!(fired[k] < UNREACHED)) return;
  const int i = source_cell[k];
  if (region[i] == NO_REGION) return;
  const int cell = first_cell[i / LANES] + i % LANES, member_grid = cell - cell % (NX * NY * NZ);
  const int3 offset = (int3)(n % across, n / across % across, n / (across * across)) - reach;
  const int j = place_at(coordinates_of(cell) + offset, member_grid, place);
  if (region[j] == NO_REGION) return;
  const real dx = origin_and_spacing.w;
  const real3 centre = centre_of(first_cell, j, origin_and_spacing);
  const real3 from = point[k].w != 0 ? point[k].xyz : centre_of(first_cell, i, origin_and_spacing);
  real arrival;
  size_t there = j;
  if (with_sheet && sheet[i] != 0) {
    if (sheet[j] != sheet[i]) return;
    const real3 own = distance_gradient(distance, i, first_cell, place, region, dx, grid_cells);
    const real3 normal = distance_gradient(distance, j, first_cell, place, region, dx, grid_cells);
    const real own_size = length(own), size = length(normal);
    // Beside surfaces known by their cells alone, and where the sheet turns, only what is next to it.
    const bool same_side = own_size > 0 && size > 0 && dot(own, normal) > SAME_SIDE * own_size * size;
    real3 way = centre - from;
    if (size > 0) way -= distance[j] / fmax(size, R(1.0)) * normal / size;
    if (point[k].w == 0 && own_size > 0) way += distance[i] / fmax(own_size, R(1.0)) * own / own_size;
    const real length_mm = length(way);
    if (j != i && (length_mm > radius || !same_side)) return;
    arrival = fired[k] + length_mm / sheet_speed[j];
    there += stride;
  } else {
    if (region[j] != region[i]) return;
    const real3 way = centre - from;
    const real length_mm = length(way);
    if (j != i) {
      if (length_mm > fmax(radius, NEAR * dx) || (length_mm > NEAR * dx && !same_metric(metric, i, j, stride))) return;
      if (linked[j] == 0 || !in_sight(from, j, member_grid, first_cell, place, region, linked, origin_and_spacing)) return;
    }
    arrival = fired[k] + sqrt(squared_way(metric, i, j, way, dx, stride));
  }
  if (!(arrival < T[there])) return;
  T[there] = T_other[there] = arrival;
  if (there == (size_t)j) correction[j] = 0;  // it is not late
  changed[j / LANES] = mark;
  *last_change = mark + 1;
}
