// Which vertices of a grid are on the surface of its tissue. Needs segments.clh.

// Vertices (members, NZ + 1, NY + 1, NX + 1): 0 outside, 1 inside, 2 on the surface; a vertex is on the surface
// when some, but not all, of the eight cells around it are tissue.
kernel void classify_vertices(global const uchar *restrict region, global uchar *restrict vertex) {
  const int x = get_global_id(0), y = get_global_id(1), z = get_global_id(2) % (NZ + 1);
  const int member = get_global_id(2) / (NZ + 1);
  int solid = 0;
  for (int k = 0; k < 8; ++k) {
    const int cx = x - 1 + (k & 1), cy = y - 1 + (k >> 1 & 1), cz = z - 1 + (k >> 2);
    const bool inside = cx >= 0 && cx < NX && cy >= 0 && cy < NY && cz >= 0 && cz < NZ;
    if (inside) solid += region[cx + (size_t)NX * (cy + (size_t)NY * (cz + (size_t)NZ * member))] != NO_REGION;
  }
  const size_t place = x + (size_t)(NX + 1) * (y + (size_t)(NY + 1) * get_global_id(2));
  vertex[place] = solid == 8 ? 1 : solid > 0 ? 2 : 0;
}
