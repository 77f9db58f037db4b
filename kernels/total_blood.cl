// For checks. Behind circulation.clh and beats.clh.

// Blood of each member in all compartments, mL.
kernel void total_blood(global const heart_state *restrict states, global wide *restrict total, const int count) {
  const int m = get_global_id(0);
  if (m >= count) return;
  wide sum = 0, lost = 0;
  for (int i = 0; i < NODES; ++i) {
    sum += states[m].loop.volume[i];
    lost += states[m].loop.lost[i];
  }
  total[m] = sum - lost;
}
