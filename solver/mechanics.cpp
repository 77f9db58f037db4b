#include "solver/mechanics.hpp"
namespace cohort {
MechanicsText mechanics_text(const Scene& s) {
  MechanicsText t;
  t.generated = "constant int material_first[] = {" ;
  for (size_t r=0;r<s.regions.size();++r) t.generated += std::to_string(s.parameters.index("mechanics.guccione.C_kPa"))+",";
  t.generated += "};\n#define M_C_kPa 0\n#define M_bf 1\n#define M_bt 2\n#define M_bfs 3\n#define M_tension_kPa 4\n#define M_bulk_modulus_kPa 5\n#define M_viscosity_kPa_ms 6\n";
  t.files = {"symmetric.clh", "laws/guccione.cl"};
  if (!s.mechanics->tension.empty()) { t.files.push_back("tension/constant.cl"); t.generated += "#define TENSION\n"; }
  return t;
}
void declare_mechanics(Scene& s) {
  auto add=[&](const char*n,double v){ s.parameters.add({std::string("mechanics.")+n,"1",v,0,1e9,"m","s"}); };
  add("guccione.C_kPa",10); add("guccione.bf",1); add("guccione.bt",1); add("guccione.bfs",1); add("constant.tension_kPa",0); add("bulk_modulus_kPa",350); add("viscosity_kPa_ms",0);
  add("density_mg_per_mm3",1.06); add("damping_per_ms",0.02);
  for (auto& b : s.mechanics->boundary) { add(("boundary."+b.name+".stiffness_kPa_per_mm").c_str(),0); add(("boundary."+b.name+".damping_kPa_ms_per_mm").c_str(),0);}
}
}
