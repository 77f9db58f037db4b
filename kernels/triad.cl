// McCalpin's triad, the bandwidth that every share in a report refers to. Bytes: 12 an element.
kernel void triad(global const float *restrict a, global const float *restrict b, global float *restrict c) {
  const size_t i = get_global_id(0);
  c[i] = a[i] + 3.0f * b[i];
}
