#include "solver/scene.hpp"

#include <stdexcept>

#include "solver/circulation.hpp"
#include "solver/conduction_system.hpp"
#include "solver/electrophysiology.hpp"
#include "solver/geometry.hpp"
#include "solver/mechanics.hpp"
#include "solver/pv_output.hpp"
#include "solver/torso.hpp"

namespace cohort {

std::string method_name(ActivationMethod method) {
  constexpr const char* names[] = {"automatic", "monodomain", "bidomain", "reaction_eikonal", "eikonal"};
  return names[static_cast<std::size_t>(method)];
}

namespace {

void declare_grid_and_time(Scene& scene) {
  ParameterTable& table = scene.parameters;
  Parameter dx{"grid.dx_mm", "mm", 2, 0.01, 20, "edge of a cell", "thesis, table of run times"};
  Parameter end{"time.end_ms", "ms", 800, 0.001, 1e6, "simulated time", "one beat at 75 beats per minute"};
  Parameter dt{"time.dt_ms", "ms", 0, 0, 10, "step of the reaction; 0: from the cell model's fastest rate",
               "measured"};
  Parameter rate{"outputs.ecg.rate_hz", "Hz", 1000, 1, 1e5, "samples of the ECG in a second",
                 "clinical recorders"};
  const bool tissue = scene.geometry != GeometryKind::none;
  const auto add = [&](Parameter& parameter, bool read) {
    parameter.structural = true;
    if (read) table.add(parameter);
  };
  add(dx, tissue);
  add(end, !scene.beats);
  add(dt, tissue);
  table.add({"time.step_factor", "1", 1, 0.25, 4,
             "times the step of the reaction, chosen or given, and circulation.dt_ms",
             "the steps as they are"});
  add(rate, tissue);
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

// What a scene without tissue cannot have.
void refuse_tissue(const Scene& scene) {
  const auto refuse = [](bool asked, const std::string& what) {
    if (asked) throw std::invalid_argument(what + " needs tissue, and the geometry is none");
  };
  refuse(scene.ecg.has_value(), "outputs.ecg");
  refuse(scene.activation.has_value(), "outputs.activation");
  refuse(scene.displacement.has_value(), "outputs.displacement");
  refuse(scene.mechanics.has_value(), "mechanics");
  refuse(!scene.stimuli.empty(), "stimuli");
  refuse(scene.conduction_system.has_value(), "electrophysiology.conduction_system");
  if (!scene.circulation)
    throw std::invalid_argument("nothing to simulate: neither tissue nor a circulation");
}

}  // namespace

void declare_parameters(Scene& scene) {
  declare_grid_and_time(scene);
  if (scene.geometry == GeometryKind::none) {
    refuse_tissue(scene);
  } else {
    declare_geometry(scene);
    declare_electrophysiology(scene);
    declare_conduction_system(scene);
    declare_stimuli(scene);
    declare_mechanics(scene);
    if (scene.ecg) declare_torso(scene.parameters, scene.torso);
    declare_probes(scene);
  }
  declare_circulation(scene);
  declare_pv_outputs(scene);
}

}  // namespace cohort
