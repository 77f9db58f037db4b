// What goes into the arrival times of a heart, and what comes out. Needs segments.clh and -D PARAMETERS, REGION_FIRST,
// REGION_STRIDE, REGION_VELOCITY_OFFSET, region_slot[].
#if !defined(REGION_FIRST) || !defined(REGION_STRIDE) || !defined(REGION_VELOCITY_OFFSET)
#error "eikonal_activation.cl needs REGION_FIRST, REGION_STRIDE and REGION_VELOCITY_OFFSET"
#endif

// Conduction velocities (2, stride), along and across fibres, of each cell's region, mm/ms.
kernel void region_speeds(global const real *restrict parameters, global const ushort *restrict member_of,
                          global const uchar *restrict tissue_region_of, global real *restrict speed, const int stride) {
  const int i = get_global_id(0), region = tissue_region_of[i];
  global const real *P = parameters + (size_t)member_of[i / LANES] * PARAMETERS;
  const int first =
      region == NO_REGION ? -1 : REGION_FIRST + REGION_STRIDE * region_slot[region] + REGION_VELOCITY_OFFSET;
  speed[i] = first < 0 ? 0 : P[first];
  speed[i + (size_t)stride] = first < 0 ? 0 : P[first + 1];
}

// Activation times (stride) as other methods record them: -1 where no wave comes before the end.
kernel void recorded_arrival(global const real *restrict arrival, global const uchar *restrict tissue_region_of,
                             global float *restrict activation, const real end) {
  const int i = get_global_id(0);
  activation[i] = tissue_region_of[i] != NO_REGION && arrival[i] <= end ? (float)arrival[i] : -1;
}
