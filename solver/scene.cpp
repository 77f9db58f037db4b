#include "solver/scene.hpp"

#include "solver/conduction_system.hpp"
#include "solver/electrophysiology.hpp"
#include "solver/geometry.hpp"
#include "solver/mechanics.hpp"
#include "solver/torso.hpp"

namespace cohort {

std::string method_name(ActivationMethod method) {
  constexpr const char* names[] = {"automatic", "monodomain", "bidomain", "reaction_eikonal", "eikonal"};
  return names[static_cast<std::size_t>(method)];
}

namespace {

void declare_grid_and_time(ParameterTable& table) {
  Parameter dx{"grid.dx_mm", "mm", 2, 0.01, 20, "edge of a cell", "thesis, table of run times"};
  Parameter end{"time.end_ms", "ms", 800, 0.001, 1e6, "simulated time", "one beat at 75 beats per minute"};
  Parameter dt{"time.dt_ms", "ms", 0, 0, 10, "step of the reaction; 0: from the cell model's fastest rate",
               "measured"};
  Parameter rate{"outputs.ecg.rate_hz", "Hz", 1000, 1, 1e5, "samples of the ECG in a second",
                 "clinical recorders"};
  for (Parameter* p : {&dx, &end, &dt, &rate}) {
    p->structural = true;
    table.add(*p);
  }
}

void declare_probes(Scene& scene) {
  if (!scene.activation) return;
  for (const std::string& probe : scene.activation->probes) {
    Parameter place{"outputs.activation.probes." + probe + "_mm",
                    "mm",
                    0,
                    -1e4,
                    1e4,
                    "where activation is read",
                    "the scene"};
    place.structural = true;
    scene.parameters.add_vector(place, 0, 0, 0);
  }
}

}  // namespace

void declare_parameters(Scene& scene) {
  declare_grid_and_time(scene.parameters);
  declare_geometry(scene);
  declare_electrophysiology(scene);
  declare_conduction_system(scene);
  declare_stimuli(scene);
  declare_mechanics(scene);
  if (scene.ecg) declare_torso(scene.parameters, scene.torso);
  declare_probes(scene);
}

}  // namespace cohort
