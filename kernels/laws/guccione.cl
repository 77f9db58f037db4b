#define LAW_SHEETS 0
inline real gq(symmetric C, real3 f, global const real *M, symmetric *S, real *bmax) {
  // E in general coordinates, invariants about f
  const symmetric E = {R(0.5)*(C.xx-1),R(0.5)*(C.yy-1),R(0.5)*(C.zz-1),R(0.5)*C.yz,R(0.5)*C.xz,R(0.5)*C.xy};
  const real3 Ef = (real3)(E.xx*f.x+E.xy*f.y+E.xz*f.z, E.xy*f.x+E.yy*f.y+E.yz*f.z, E.xz*f.x+E.yz*f.y+E.zz*f.z);
  const real ff = dot(f,Ef);
  const real EE = E.xx*E.xx+E.yy*E.yy+E.zz*E.zz+2*(E.yz*E.yz+E.xz*E.xz+E.xy*E.xy);
  const real fEEf = dot(Ef,Ef);
  const real bf=M[M_bf],bt=M[M_bt],bfs=M[M_bfs];
  // sum over f,s,n: ff^2 bf + bfs 2 (fEEf - ff^2) + bt (EE - 2 fEEf + ff^2)
  const real a=bf-2*bfs+bt, b=2*(bfs-bt);
  const real Q = a*ff*ff + b*fEEf + bt*EE;
  // dQ/dE = 2 a ff f f + b (f Ef + Ef f) + 2 bt E
  S->xx=2*a*ff*f.x*f.x+2*b*f.x*Ef.x+2*bt*E.xx;
  S->yy=2*a*ff*f.y*f.y+2*b*f.y*Ef.y+2*bt*E.yy;
  S->zz=2*a*ff*f.z*f.z+2*b*f.z*Ef.z+2*bt*E.zz;
  S->yz=2*a*ff*f.y*f.z+b*(f.y*Ef.z+f.z*Ef.y)+2*bt*E.yz;
  S->xz=2*a*ff*f.x*f.z+b*(f.x*Ef.z+f.z*Ef.x)+2*bt*E.xz;
  S->xy=2*a*ff*f.x*f.y+b*(f.x*Ef.y+f.y*Ef.x)+2*bt*E.xy;
  *bmax=fmax(bf,fmax(bt,bfs));
  return Q;
}
symmetric law_stress(symmetric C, real J, real3 f, real3 s, global const real *M) {
  symmetric S; real b;
  const real Q=gq(C,f,M,&S,&b), k=R(0.5)*M[M_C_kPa]*exp(Q);
  S.xx*=k;S.yy*=k;S.zz*=k;S.yz*=k;S.xz*=k;S.xy*=k;
  return S;
}
real law_energy(symmetric C, real J, real3 f, real3 s, global const real *M) {
  symmetric S; real b;
  return R(0.5)*M[M_C_kPa]*(exp(gq(C,f,M,&S,&b))-1);
}
real law_stiffness(symmetric C, real J, real3 f, real3 s, global const real *M) {
  symmetric S; real b; const real Q=gq(C,f,M,&S,&b);
  return M[M_C_kPa]*b*exp(Q)*(1+2*Q);
}
