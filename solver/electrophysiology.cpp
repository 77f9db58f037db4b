#include "solver/electrophysiology.hpp"

#include <algorithm>
#include <stdexcept>

#include "solver/cell_models.hpp"
#include "solver/heterogeneity.hpp"

namespace cohort {

namespace {

constexpr const char* thesis = "thesis, section 7.1 (0.20 and 0.05 mS/mm)";
constexpr const char* niederer = "Niederer et al. 2011, table 1";

constexpr const char* conductivity = "conductivity_longitudinal_mS_per_mm";
constexpr const char* intracellular = "intracellular_longitudinal_mS_per_mm";
constexpr const char* extracellular = "extracellular_longitudinal_mS_per_mm";
constexpr const char* velocity = "velocity_longitudinal_mm_per_ms";

// The conductivities and velocities that a region may set for itself, in the order of its run in the table:
// those that the scene's equations read.
std::vector<Parameter> conductivities(const Scene& scene) {
  const bool bidomain = scene.activation_method == ActivationMethod::bidomain;
  std::vector<Parameter> list;
  if (!bidomain && scene.activation_method != ActivationMethod::eikonal)
    list = {
        {conductivity, "mS/mm", 0.20, 0, 10, "monodomain conductivity along fibres", thesis},
        {"conductivity_transverse_mS_per_mm", "mS/mm", 0.05, 0, 10, "monodomain conductivity across fibres",
         thesis},
    };
  list.push_back({intracellular, "mS/mm", 0.17, 0, 10,
                  "intracellular conductivity along fibres, source of the ECG", niederer});
  list.push_back({"intracellular_transverse_mS_per_mm", "mS/mm", 0.044, 0, 10,
                  "intracellular conductivity across fibres, source of the ECG",
                  "ratio to the longitudinal one as in the monodomain conductivities"});
  if (bidomain) {
    list.push_back(
        {extracellular, "mS/mm", 0.62, 1e-4, 10, "extracellular conductivity along fibres", niederer});
    list.push_back({"extracellular_transverse_mS_per_mm", "mS/mm", 0.24, 1e-4, 10,
                    "extracellular conductivity across fibres", niederer});
  }
  if (!bidomain && scene.activation_method != ActivationMethod::monodomain) {
    list.push_back({velocity, "mm/ms", 0, 0, 10,
                    "eikonal conduction velocity along fibres; 0: that of the cell model in a cable of this "
                    "conductivity",
                    "the cell model"});
    list.push_back({"velocity_transverse_mm_per_ms", "mm/ms", 0, 0, 10,
                    "eikonal conduction velocity across fibres; 0: that of the cell model in a cable of this "
                    "conductivity",
                    "the cell model"});
  }
  return list;
}

// What the bidomain equations have beside the conductivities of tissue.
void declare_bidomain(Scene& scene) {
  ParameterTable& table = scene.parameters;
  const std::string root = "electrophysiology.";
  const char* by_choice = "chosen";
  Parameter tolerance{root + "elliptic_tolerance",
                      "1",
                      1e-5,
                      1e-12,
                      1e-2,
                      "residual of the extracellular potential over its source",
                      "measured: solver/README.md"};
  tolerance.structural = true;
  table.add(tolerance);
  table.add_vector({root + "boundary_current_uA_per_mm2", "uA/mm2", 0, -1000, 1000,
                    "current density that enters through the lower end of what conducts along this axis and "
                    "leaves through the upper one",
                    by_choice},
                   0, 0, 0);
  table.add({root + "boundary_current_start_ms", "ms", 0, 0, 1e6, "when it begins", by_choice});
  table.add({root + "boundary_current_duration_ms", "ms", 0, 0, 1e6, "how long it flows", by_choice});
  for (const Region& region : scene.regions)
    if (region.bath)
      table.add({root + "regions." + region.name + ".bath_conductivity_mS_per_mm", "mS/mm", 0.66, 1e-4, 100,
                 "conductivity of the bath, isotropic",
                 "blood: Gabriel, Lau & Gabriel, Phys. Med. Biol. 41 (1996) 2251"});
}

// The non-selective current of Pueyo et al. 2016, J. Mol. Cell. Cardiol. 97:93, as public implementations of
// the O'Hara-Rudy-Land model have it.
void declare_stretch_activated(Scene& scene) {
  const std::string root = "electrophysiology.stretch_activated.";
  constexpr const char* source = "Pueyo et al. 2016, as a public implementation has it";
  scene.parameters.add({root + "conductance_mS_per_uF", "mS/uF", 0.006, 0, 10,
                        "of stretch-activated channels at the reference stretch", source});
  scene.parameters.add(
      {root + "reversal_mV", "mV", -10, -120, 120, "potential at which their current turns", source});
  scene.parameters.add({root + "reference_stretch", "1", 1.1, 1.001, 3,
                        "stretch along fibres at which the conductance is the one given; it grows "
                        "in proportion from 0 at 1",
                        source});
}

}  // namespace

void declare_electrophysiology(Scene& scene) {
  ParameterTable& table = scene.parameters;
  const std::string root = "electrophysiology.";
  for (Parameter p : conductivities(scene)) {
    p.path = root + p.path;
    table.add(p);
  }
  table.add({root + "surface_to_volume_per_mm", "1/mm", 140, 1, 10000, "membrane area in a volume of tissue",
             niederer});
  table.add({root + "capacitance_uF_per_mm2", "uF/mm2", 0.01, 1e-4, 100, "membrane capacitance", niederer});
  table.add({root + "activation_threshold_mV", "mV", 0, -200, 200,
             "a cell is activated when its potential first rises through this", niederer});

  if (scene.activation_method == ActivationMethod::bidomain) declare_bidomain(scene);
  if (scene.stretch_activated) declare_stretch_activated(scene);

  for (const auto& [name, model] : scene.region_cell_models)
    if (std::none_of(scene.regions.begin(), scene.regions.end(),
                     [&](const Region& region) { return region.name == name && region.excitable; }))
      throw std::invalid_argument(root + "regions." + name + ": there is no excitable region of that name");
  const CellModels models(scene);
  for (const CellModel& model : models.all())
    for (Parameter p : model.parameters) {
      p.path = root + model.name + "." + p.path;
      table.add(p);
    }
  const auto add_copy = [&](Parameter p, const std::string& inherits_from, const Region& region) {
    p.inherits = inherits_from + p.path;
    p.path = root + "regions." + region.name + "." + p.path;
    p.value = inherited;
    table.add(p);
  };
  for (const Region& region : scene.regions) {
    if (!region.excitable) continue;
    for (const Parameter& p : conductivities(scene)) add_copy(p, root, region);
  }
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    if (!scene.regions[r].excitable) continue;
    const CellModel& model = models.all()[static_cast<size_t>(models.of_region()[r])];
    for (const Parameter& p : model.parameters) add_copy(p, root + model.name + ".", scene.regions[r]);
  }
  declare_heterogeneity(scene);
}

RegionParameters region_parameters(const Scene& scene) {
  const CellModels models(scene);
  const ParameterTable& table = scene.parameters;
  const std::string root = "electrophysiology.";
  RegionParameters result{};
  const std::vector<Parameter> run_of_region = conductivities(scene);
  const auto offset = [&](const char* path) {
    const auto found = std::find_if(run_of_region.begin(), run_of_region.end(),
                                    [&](const Parameter& p) { return p.path == path; });
    return found == run_of_region.end() ? -1 : static_cast<int>(found - run_of_region.begin());
  };
  result.conductivity_offset = offset(conductivity);
  result.intracellular_offset = offset(intracellular);
  result.velocity_offset = offset(velocity);
  result.extracellular_offset = offset(extracellular);
  result.stride = static_cast<int>(run_of_region.size());
  result.first = -1;
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    const Region& region = scene.regions[r];
    result.slot.push_back(region.excitable ? result.slots++ : -1);
    result.bath.push_back(
        scene.parameters.find("electrophysiology.regions." + region.name + ".bath_conductivity_mS_per_mm"));
    result.cell_first.push_back(-1);
    if (!region.excitable) continue;
    const std::string run = root + "regions." + region.name + ".";
    if (result.first < 0) result.first = table.index(run + run_of_region.front().path);
    const CellModel& model = models.all()[static_cast<size_t>(models.of_region()[r])];
    result.cell_first.back() = table.index(run + model.parameters.front().path);
  }
  for (const CellModel& model : models.all())
    result.model_first.push_back(table.index(root + model.name + "." + model.parameters.front().path));
  return result;
}

std::string unread_parameter(const Scene& scene, const std::string& name) {
  const bool bidomain = scene.activation_method == ActivationMethod::bidomain;
  const auto stands_in = [](const std::vector<Parameter>& list, const std::string& path) {
    return std::any_of(list.begin(), list.end(), [&](const Parameter& p) { return p.path == path; });
  };
  if (stands_in(conductivities(scene), name)) return {};
  if (name.starts_with("velocity_")) {
    Scene other;
    other.activation_method = ActivationMethod::reaction_eikonal;
    if (!stands_in(conductivities(other), name)) return {};
    return name + " has no effect with activation: " + (bidomain ? "bidomain" : "monodomain") +
           ", which conducts by its conductivities; eikonal and reaction_eikonal take velocities";
  }
  if (name.starts_with("conductivity_")) {
    Scene other;
    other.activation_method = ActivationMethod::monodomain;
    if (!stands_in(conductivities(other), name)) return {};
    return name + " has no effect with activation: " +
           (bidomain ? "bidomain, which takes the intracellular and extracellular conductivities"
                     : "eikonal, which takes velocities");
  }
  Scene other;
  other.activation_method = ActivationMethod::bidomain;
  if (!stands_in(conductivities(other), name)) return {};
  return name + " has no effect without activation: bidomain";
}

std::vector<std::pair<int, double>> region_defaults(const Scene& scene, const std::string& beginning) {
  const RegionParameters regions = region_parameters(scene);
  const std::vector<Parameter> run_of_region = conductivities(scene);
  std::vector<std::pair<int, double>> result;
  for (const int slot : regions.slot)
    for (size_t k = 0; k < run_of_region.size() && slot >= 0; ++k)
      if (run_of_region[k].path.starts_with(beginning))
        result.emplace_back(regions.first + slot * regions.stride + static_cast<int>(k),
                            run_of_region[k].value);
  return result;
}

void declare_stimuli(Scene& scene) {
  ParameterTable& table = scene.parameters;
  for (const Stimulus& stimulus : scene.stimuli) {
    const std::string root = "stimuli." + stimulus.name + ".";
    const char* source = "the scene";
    table.add({root + "start_ms", "ms", 0, 0, 1e6, "start of the first pulse", source});
    table.add({root + "duration_ms", "ms", 2, 1e-3, 1e6, "length of a pulse", niederer});
    table.add({root + "period_ms", "ms", 0, 0, 1e6, "from pulse to pulse; 0: one pulse only", source});
    table.add({root + "count", "1", 1, 1, 1e6, "number of pulses, with a period", source});
    table.add({root + "s2_interval_ms", "ms", 0, 0, 1e6,
               "from the start of the last pulse to that of one more, S2; 0: none", source});
    table.add({root + "amplitude_mV_per_ms", "mV/ms", 35.714, -1000, 1000, "rate of change of the potential",
               niederer});
    const Parameter length{"", "mm", 0, -1e4, 1e4, "where it acts", source};
    if (stimulus.kind == Stimulus::Kind::box) {
      Parameter lower = length, upper = length;
      lower.path = root + "lower_mm";
      upper.path = root + "upper_mm";
      table.add_vector(lower, 0, 0, 0);
      table.add_vector(upper, 1.5, 1.5, 1.5);
    } else {
      if (stimulus.kind == Stimulus::Kind::sphere) {
        Parameter centre = length;
        centre.path = root + "centre_mm";
        table.add_vector(centre, 0, 0, 0);
      }
      table.add({root + "radius_mm", "mm", 5, 0.01, 1000, "radius within which it acts", source});
    }
  }
}

}  // namespace cohort
