// For checks. Behind circulation.clh and beats.clh.

// Blood of each member in all compartments, mL.
kernel void total_blood(global const heart_state *restrict states, global wide *restrict total, const int count) {
  const int m = get_global_id(0);
  if (m >= count) return;
  const heart_state h = states[m];
  total[m] = blood_of(&h.loop);
}
