#define TENSION_STATES 0
#define TENSION_PER_STRETCH2 0
real tension_step(real *state, real since, real beat, real drive, real stretch, real rate, real dt, global const real *M) { return M[M_tension_kPa]; }
