// Members that wait for the cells that drive them: their tissue moves up to the end of a window of time, and stands there until all members of
// the batch have come and the next window is known. A member that waits is as it was, bit for bit: no launch changes it but for the length of
// its step. Needs solid_reduce.clh; -D WINDOWS.

// Time since the first beat's begin, ms.
inline wide beating_for(global const wide *S) { return S[BEAT] * S[BEAT_LENGTH] + S[BEAT_TIME]; }

// The steps that are left of a window share it.
inline wide share_of_window(wide left, wide step) {
  const wide steps = fmax(ceil(left / step - (wide)1e-6f), (wide)1);
  return steps > 50 ? step : left / steps;
}

// The step behind one of dt ms that would have been `next`; 0 where the member has come to the window's end.
inline wide wait_at_window(global wide *S, wide dt, wide next) {
  if (S[BEAT_TIME] < 0) return next;
  // What windows are shared into must not hold back the growth of what there is to share.
  next = fmin(S[LARGEST_STEP], fmax(next, STEP_GROWTH * S[HELD_STEP]));
  S[HELD_STEP] = next;
  const wide left = S[WINDOW_END] - beating_for(S);
  if (left > (wide)1e-6f * next) return share_of_window(left, next);
  S[WAITS] = 1;
  S[HELD_BEHIND] = dt;
  return 0;
}

// Members go on to whole + fraction ms since the first beat's begin; the step under way is of number odd.
kernel void solid_release(global wide *restrict state, const real whole, const real fraction, const int odd, const int members) {
  const int member = get_global_id(0);
  if (member >= members) return;
  global wide *S = state + member * MEMBER_STATE;
  S[WINDOW_END] = (wide)whole + (wide)fraction;
  if (S[WAITS] == 0 || S[ENDED] != 0) return;
  S[WAITS] = 0;
  S[STEP + odd] = share_of_window(S[WINDOW_END] - beating_for(S), S[HELD_STEP]);
  S[STEP + 1 - odd] = S[HELD_BEHIND];
}
