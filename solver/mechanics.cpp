#include "solver/mechanics.hpp"

#include <algorithm>
#include <stdexcept>

#include "solver/cell_models.hpp"
#include "solver/circulation.hpp"
#include "solver/kernel_declarations.hpp"
#include "solver/mechanics_structure.hpp"

namespace cohort {

namespace {

const std::string root = "mechanics.";
constexpr const char* measured = "measured: gives physiological loops with the default heart";
constexpr const char* by_choice = "chosen";

int whole_number(std::istringstream& words, int most) {
  int number = -1;
  words >> number;
  if (!words || number < 0 || number > most)
    throw std::invalid_argument("want a whole number from 0 to " + std::to_string(most));
  return number;
}

MaterialFile read_material(const std::string& folder, const std::string& name) {
  constexpr int most_states = 64;
  MaterialFile file;
  file.name = name;
  read_declarations(folder, name, [&](const std::string& kind, std::istringstream& words) {
    if (kind == "parameter") {
      file.parameters.push_back(read_parameter(words));
    } else if (kind == "sheets" && folder == "laws") {
      file.sheets = whole_number(words, 1) == 1;
    } else if (kind == "states" && folder == "tension") {
      file.states = whole_number(words, most_states);
    } else if (kind == "per_stretch2" && folder == "tension") {
      file.per_stretch2 = whole_number(words, 1) == 1;
    } else if (kind == "drive" && folder == "tension") {
      std::string drive;
      words >> drive;
      if (drive == "potential")
        file.drive = MaterialFile::Drive::potential;
      else if (drive == "calcium")
        file.drive = MaterialFile::Drive::calcium;
      else if (drive != "none")
        throw std::invalid_argument("drive: want none, potential or calcium");
    } else {
      throw std::invalid_argument("unknown declaration " + kind);
    }
  });
  return file;
}

// Of every region beside its law and tension.
std::vector<Parameter> solid_parameters() {
  return {{"bulk_modulus_kPa", "kPa", 350, 1e-3, 1e7, "resistance to change of volume",
           "measured: 35 to 3500 moves the ejection fraction by 1.5 points"},
          {"viscosity_kPa_ms", "kPa ms", 0, 0, 1e4, "viscous second Piola-Kirchhoff stress over dE/dt",
           "measured: more than 20 costs many steps for little"}};
}

// Numbers of a region, in the order of its block, as mechanics.<group>.<name>.
struct Group {
  std::string path;
  std::vector<Parameter> parameters;
};
std::vector<Group> groups(const Mechanics& mechanics) {
  std::vector<Group> result = {{root + mechanics.law + ".", read_law(mechanics.law).parameters}};
  if (!mechanics.tension.empty())
    result.push_back({root + mechanics.tension + ".", read_tension(mechanics.tension).parameters});
  result.push_back({root, solid_parameters()});
  return result;
}

void check_calcium(const Scene& scene) {
  if (scene.mechanics->tension.empty() ||
      read_tension(scene.mechanics->tension).drive != MaterialFile::Drive::calcium)
    return;
  const CellModels models(scene);
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    if (!scene.regions[r].excitable) continue;
    const CellModel& model = models.all()[static_cast<std::size_t>(models.of_region()[r])];
    if (std::none_of(model.states.begin(), model.states.end(),
                     [](const CellModel::State& state) { return state.name == "Cai"; }))
      throw std::invalid_argument(root + "tension: " + scene.mechanics->tension +
                                  " is driven by intracellular calcium, which cell model " + model.name +
                                  " of region \"" + scene.regions[r].name + "\" does not have");
  }
}

void declare_boundary(Scene& scene) {
  using Kind = Mechanics::Boundary::Kind;
  for (const Mechanics::Boundary& boundary : scene.mechanics->boundary) {
    if (boundary.kind != Kind::spring && boundary.kind != Kind::spring_normal) continue;
    const std::string path = root + "boundary." + boundary.name + ".";
    constexpr double at_base = 0.5, elsewhere = 0.1;
    scene.parameters.add({path + "stiffness_kPa_per_mm", "kPa/mm",
                          boundary.surface == "base" ? at_base : elsewhere, 0, 1e6,
                          "traction over displacement", measured});
    scene.parameters.add({path + "damping_kPa_ms_per_mm", "kPa ms/mm", 0.5, 0, 1e6,
                          "traction over velocity, parallel to the spring", "measured: without, it rings"});
  }
}

// Prescribed loads, and when the tissue rests under them.
void declare_load(Scene& scene) {
  const std::string load = root + "load.";
  const auto structural = [&](const char* name, const char* unit, double value, double lower, double upper,
                              const char* meaning, const char* source) {
    Parameter p{load + name, unit, value, lower, upper, meaning, source};
    p.structural = true;
    scene.parameters.add(p);
  };
  structural("ramp_ms", "ms", 5, 0, 1e6, "over which pressures and a constant tension rise", "chosen");
  if (!scene.mechanics->quasi_static) return;
  structural("at_most_ms", "ms", 2000, 1, 1e9, "a member that does not rest by then has failed", "chosen");
  structural("tolerance", "1", 1e-3, 1e-6, 0.1,
             "norm of the forces not in balance over that of the pressures' forces", "solver/README.md");
}

// Where a label map's walls end.
void declare_planes(Scene& scene) {
  const auto plane = [&](const char* name, double value, const char* meaning, const char* source) {
    Parameter p{root + name, "mm", value, -100, 100, meaning, source};
    p.structural = true;
    scene.parameters.add(p);
  };
  plane("base_mm", 0, "height at which the ventricles' walls are cut; the next face of the grid",
        "the atrioventricular plane of the map's frame");
  if (deforming_walls(*scene.mechanics).atria())
    plane("atrial_base_mm", 4, "height at which the atria's walls begin; at least a cell above the base",
          "the plate of the schematic heart");
}

void declare_cavities(Scene& scene) {
  const Mechanics& mechanics = *scene.mechanics;
  ParameterTable& table = scene.parameters;
  if (mechanics.cavities.empty()) return;
  if (!scene.circulation) {
    for (const Mechanics::Cavity& cavity : mechanics.cavities) {
      if (cavity.pressure == Mechanics::Cavity::Pressure::constant)
        table.add({root + "cavities." + cavity.name + ".pressure_kPa", "kPa", 0, -1e4, 1e4,
                   "pressure in the cavity, on its deformed surface", "the scene"});
      else if (mechanics.tension != "bestel")
        throw std::invalid_argument(root + "cavities." + cavity.name +
                                    ".pressure: bestel shares its numbers with the tension bestel");
    }
    return;
  }
  const std::string inflation = root + "inflation.";
  table.add({inflation + "duration_ms", "ms", 120, 1, 1e5,
             "from no pressure to that of the first beat's begin", "measured: 20 to 40 ms jolt"});
  table.add({inflation + "damping_per_ms", "1/ms", 0.15, 0, 100, "damping of the mass meanwhile", measured});
  for (const Mechanics::Cavity& cavity : mechanics.cavities) {
    // Where a periodic beat begins, before the atria contract: with ventricles of tissue, or of elastance.
    const bool ventricles = is_tissue(scene, Chamber::lv) || is_tissue(scene, Chamber::rv);
    const double left = ventricles ? 4.2 : 15, right = ventricles ? 1.5 : 6;
    Parameter pressure{inflation + cavity.name + "_pressure_mmHg",
                       "mmHg",
                       cavity.name.starts_with("r") ? right : left,
                       0,
                       200,
                       "pressure to which it is inflated",
                       measured};
    if (scene.circulation->kind == Circulation::Kind::windkessel) {  // else the valve opens with a jolt
      pressure.value = inherited;
      pressure.inherits = "circulation.windkessel.filling_pressure_mmHg";
    }
    table.add(pressure);
  }
}

}  // namespace

std::vector<std::string> laws() {
  return kernels_in("laws");
}
std::vector<std::string> tensions() {
  return kernels_in("tension");
}
MaterialFile read_law(const std::string& name) {
  return read_material("laws", name);
}
MaterialFile read_tension(const std::string& name) {
  return read_material("tension", name);
}

void declare_mechanics(Scene& scene) {
  if (!scene.mechanics) return;
  check_calcium(scene);
  ParameterTable& table = scene.parameters;
  table.add(
      {root + "density_mg_per_mm3", "mg/mm3", 1.06, 1e-3, 100, "mass of tissue in a volume", "muscle: 1.06"});
  table.add({root + "damping_per_ms", "1/ms", 0.02, 0, 100, "damping of the mass in beats",
             "measured: 0 is stable too"});
  table.add({root + "step_factor", "1", 1, 0.25, 4, "times the largest step that the speed of waves allows",
             "the bound: solver/README.md"});
  Parameter dx{root + "dx_mm",
               "mm",
               0,
               0,
               20,
               "edge of a cell of the mechanics' grid, the scene's where that is larger; 0: the scene's",
               "the scene"};
  dx.structural = true;
  table.add(dx);
  if (scene.geometry == GeometryKind::labels) declare_planes(scene);
  if (!scene.circulation) declare_load(scene);
  if (!scene.mechanics->tension.empty() &&
      read_tension(scene.mechanics->tension).drive != MaterialFile::Drive::none) {
    Parameter beats{root + "drive_beats",
                    "1",
                    1,
                    1,
                    1000,
                    "paced beats of a cell from rest, of which the last one's potential or calcium drives "
                    "the tension behind arrival times",
                    "1: as the templates of the ECG"};
    beats.structural = true;
    table.add(beats);
  }
  const std::vector<Group> all = groups(*scene.mechanics);
  for (const Group& group : all)
    for (Parameter p : group.parameters) {
      p.path = group.path + p.path;
      table.add(p);
    }
  for (const Region& region : scene.regions) {
    if (region.bath || !deforms(scene, region.name)) continue;
    for (const Group& group : all)
      for (Parameter p : group.parameters) {
        const std::string bare = p.path;
        p.inherits = group.path + p.path;
        p.path = root + "regions." + region.name + "." + p.path;
        p.value = inherited;
        if (const auto own = atrial_default(scene, region.name, bare)) {
          p.value = *own;
          p.source = "chosen: solver/README.md, atria of tissue";
        }
        table.add(p);
      }
  }
  declare_boundary(scene);
  declare_cavities(scene);
}

MechanicsText mechanics_text(const Scene& scene) {
  const Mechanics& mechanics = *scene.mechanics;
  MechanicsText text;
  text.law = read_law(mechanics.law);
  if (!mechanics.tension.empty()) text.tension = read_tension(mechanics.tension);
  const bool active = !mechanics.tension.empty();
  const auto define = [&](const std::string& name, int value) {
    text.generated += "#define " + name + " " + std::to_string(value) + "\n";
  };
  int place = 0;
  std::string first;
  for (const Group& group : groups(mechanics))
    for (const Parameter& p : group.parameters) {
      if (place == 0) first = p.path;
      define("M_" + p.path, place++);
    }
  define("LAW_SHEETS", text.law.sheets);
  define("TENSION", active);
  define("TENSION_STATES", text.tension.states);
  define("TENSION_NEEDS_POTENTIAL", text.tension.drive == MaterialFile::Drive::potential);
  define("TENSION_NEEDS_CALCIUM", text.tension.drive == MaterialFile::Drive::calcium);
  define("TENSION_PER_STRETCH2", text.tension.per_stretch2);
  text.generated += "constant int material_first[] = {";
  for (const Region& region : scene.regions)
    text.generated +=
        std::to_string(scene.parameters.find(root + "regions." + region.name + "." + first)) + ", ";
  text.generated += "};\n";
  bool driven = false;
  std::string which;
  for (const Mechanics::Cavity& cavity : mechanics.cavities) {
    const bool own = cavity.pressure == Mechanics::Cavity::Pressure::bestel;
    driven = driven || own;
    which += own ? "1, " : "0, ";
  }
  define("DRIVEN_CAVITIES", driven);
  if (driven) {
    text.generated += "constant int driven_cavity[] = {" + which + "};\n";
    define("MATERIAL_OF_SCENE", scene.parameters.index(root + mechanics.law + "." + first));
  }
  text.files = {"symmetric.clh", "laws.clh", "laws/" + mechanics.law + ".cl"};
  if (active) text.files.insert(text.files.end(), {"tension.clh", "tension/" + mechanics.tension + ".cl"});
  return text;
}

double solid_dx_mm(const Scene& scene) {
  return std::max(scene.parameters.value(root + "dx_mm"), scene.parameters.value("grid.dx_mm"));
}

bool viscous(const Scene& scene, std::span<const double> values) {
  for (const Region& region : scene.regions) {
    const int place = scene.parameters.find(root + "regions." + region.name + ".viscosity_kPa_ms");
    if (place >= 0 && values[static_cast<std::size_t>(place)] > 0) return true;
  }
  return false;
}

}  // namespace cohort
