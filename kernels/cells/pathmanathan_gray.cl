// Pathmanathan & Gray 2014, Int. J. Numer. Meth. Biomed. Engng. 30:525, doi 10.1002/cnm.2615: the cell model with which
// the monodomain and bidomain equations have exact solutions. Dimensionless; for verification only.
//     u1' = (u1+u3-V)^2 u2^2 + (u1+u3-V) u2^2 (V-u3) / 2,   u2' = -(u1+u3-V) u2^3,   u3' = 0
//     I_ion = -(Cm/2) (u1+u3-V) u2^2 (V-u3) + (beta/chi) (V-u3);   dV/dt = -I_ion / Cm
//
//@ parameter beta -1.1 -100 100 1 "constant of the current; -1.1, -5.9, -8.6 in 1, 2, 3 dimensions" "Pathmanathan & Gray 2014"
//@ parameter chi_times_capacitance 6 0.001 1000 1 "chi Cm" "Pathmanathan & Gray 2014"
//@ parameter resting 0 -10 10 1 "initial potential where none is given" "zero"
//@ rest resting
//@ state u1 1
//@ state u2 1
//@ state u3 0
//@ derived leak beta chi_times_capacitance

void cell_derive(const real *p, real dt, real *d) { d[D_leak] = -p[P_beta] / p[P_chi_times_capacitance]; }

real cell_fastest_rate(const real *p) { return fabs(p[P_beta]) / p[P_chi_times_capacitance] + 1; }

// Explicit midpoint rule for V, u1 and u2.
void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) {
  realv v = *V, u1 = state[S_u1], u2 = state[S_u2];
  const realv u3 = state[S_u3];
  for (int stage = 0; stage < 2; ++stage) {
    const realv g = u1 + u3 - v, u2_squared = u2 * u2, w = v - u3;
    const realv dV = R(0.5) * g * u2_squared * w + d[D_leak] * w + stimulus;
    const realv du1 = g * g * u2_squared + R(0.5) * g * u2_squared * w;
    const realv du2 = -g * u2_squared * u2;
    const real step = stage == 0 ? R(0.5) * dt : dt;
    v = fma(step, dV, *V);
    u1 = fma(step, du1, state[S_u1]);
    u2 = fma(step, du2, state[S_u2]);
  }
  *V = v;
  state[S_u1] = u1;
  state[S_u2] = u2;
}
