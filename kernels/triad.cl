// McCalpin's triad, the bandwidth that every share in a report refers to. Bytes: 48 an item of four elements.
kernel void triad(global const float4 *restrict a, global const float4 *restrict b, global float4 *restrict c) {
  const size_t i = get_global_id(0);
  c[i] = a[i] + 3.0f * b[i];
}
