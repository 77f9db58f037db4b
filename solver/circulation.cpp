#include "solver/circulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace cohort {

namespace {

constexpr const char* regazzoni = "Regazzoni et al. 2022";
constexpr const char* by_choice = "chosen";
constexpr std::array<const char*, 4> valve_names = {"mitral", "aortic", "tricuspid", "pulmonary"};
constexpr std::array<const char*, 4> vessel_names = {"systemic.arterial", "systemic.venous",
                                                     "pulmonary.arterial", "pulmonary.venous"};

bool closed_loop(const Scene& scene) {
  return scene.circulation->kind == Circulation::Kind::closed_loop;
}

// A windkessel has one chamber and the two valves of it.
std::size_t chambers_of(const Scene& scene) {
  return closed_loop(scene) ? chamber_count : 1;
}
std::size_t valves_of(const Scene& scene) {
  return closed_loop(scene) ? 4 : 2;
}

bool ventricles_of_tissue(const Scene& scene) {
  return is_tissue(scene, Chamber::lv) || is_tissue(scene, Chamber::rv);
}

bool any_tissue(const Scene& scene) {
  for (std::size_t q = 0; q < chamber_count; ++q)
    if (is_tissue(scene, static_cast<Chamber>(q))) return true;
  return false;
}

void declare_beat(Scene& scene) {
  const char* source = "75 beats per minute, as Regazzoni et al. 2022";
  Parameter length{scene.beats ? "time.beats.length_ms" : "time.beat_ms",
                   "ms",
                   800,
                   200,
                   5000,
                   "period of the heart",
                   source};
  Parameter until{
      "time.beats.until_periodic",
      "1",
      0.01,
      0,
      1,
      "beats end when no extremum of any pressure or volume differs by more from the beat before, "
      "relative to itself or to 1 mmHg or 1 mL, whichever is more",
      by_choice};
  Parameter at_most{"time.beats.at_most", "1", 10, 1, 10000, "beats at most, a whole number", by_choice};
  length.structural = until.structural = at_most.structural = true;
  scene.parameters.add(length);
  if (!scene.beats) return;
  scene.parameters.add(until);
  scene.parameters.add(at_most);
}

struct Elastance {
  double active, passive, start_ms, contraction_ms, relaxation_ms, unstressed_mL, wall = 0;
};

// Regazzoni's, whose atria contract with the ventricles (0.9 s, modulo a beat of 0.8 s). Before ventricles of
// tissue the atria contract before them, and behind atria of tissue, which the sinus node's wave contracts,
// the ventricles after them.
Elastance default_elastance(const Scene& scene, Chamber chamber) {
  const bool before_tissue = ventricles_of_tissue(scene);
  const double start = is_tissue(scene, Chamber::la) || is_tissue(scene, Chamber::ra) ? 180 : 100;
  switch (chamber) {
    case Chamber::lv:
      return {4.482, 0.170, start, 250, 400, 42};
    case Chamber::rv:
      return {0.200, 0.029, start, 250, 400, 16};
    case Chamber::la:
      return before_tissue ? Elastance{0.25, 0.14, 85, 100, 110, 4, 0.006}
                           : Elastance{0.07, 0.18, 900, 170, 170, 4};
    case Chamber::ra:
      return before_tissue ? Elastance{0.15, 0.07, 50, 100, 100, 4, 0.008}
                           : Elastance{0.06, 0.07, 900, 170, 170, 4};
  }
  throw std::logic_error("unknown chamber");
}

constexpr const char* before_ventricles = "measured on ventricles of tissue: solver/README.md";

void declare_chambers(Scene& scene) {
  for (std::size_t q = 0; q < chambers_of(scene); ++q) {
    const auto chamber = static_cast<Chamber>(q);
    if (is_tissue(scene, chamber)) continue;
    const bool atrium = chamber == Chamber::la || chamber == Chamber::ra;
    const char* source = atrium && ventricles_of_tissue(scene) ? before_ventricles : regazzoni;
    const std::string root = std::string("circulation.") + chamber_names[q] + ".";
    const Elastance e = default_elastance(scene, chamber);
    ParameterTable& table = scene.parameters;
    table.add({root + "active_elastance_mmHg_per_mL", "mmHg/mL", e.active, 0, 50,
               "what contraction adds to the elastance", source});
    table.add({root + "passive_elastance_mmHg_per_mL", "mmHg/mL", e.passive, 1e-3, 10, "elastance at rest",
               source});
    table.add({root + "contraction_start_ms", "ms", e.start_ms, 0, 5000,
               "when contraction begins, in each beat (modulo its length)", source});
    table.add({root + "contraction_ms", "ms", e.contraction_ms, 1, 2000, "how long elastance rises", source});
    table.add({root + "relaxation_ms", "ms", e.relaxation_ms, 1, 2000, "how long it falls", source});
    table.add(
        {root + "unstressed_volume_mL", "mL", e.unstressed_mL, 0, 500, "volume without pressure", source});
    table.add({root + "wall_resistance_mmHg_s_per_mL", "mmHg s/mL", e.wall, 0, 10,
               "of the wall to its own stretching: pressure by the rate of volume", source});
  }
}

void declare_valves(Scene& scene) {
  ParameterTable& table = scene.parameters;
  const std::string root = "circulation.valves.";
  const Parameter open{
      root + "open_resistance_mmHg_s_per_mL", "mmHg s/mL", 0.0075, 1e-4, 10, "of an open valve", regazzoni},
      closed{root + "closed_resistance_mmHg_s_per_mL",   "mmHg s/mL", 75006.2, 0.01, 1e9,
             "of a closed valve; less is regurgitation", regazzoni};
  table.add(open);
  table.add(closed);
  table.add({root + "opening_pressure_mmHg", "mmHg", std::log(75006.2 / 0.0075) / (100 * M_PI * M_PI), 0, 10,
             "that an open valve holds back",
             "asymptote of the smoothed valve of Regazzoni et al. 2022: solver/README.md"});
  for (std::size_t v = 0; v < valves_of(scene); ++v)
    for (Parameter own : {open, closed}) {
      own.inherits = own.path;
      own.path = root + valve_names[v] + own.path.substr(root.size() - 1);
      own.meaning = std::string(valve_names[v]) + " valve: " + own.meaning;
      own.value = inherited;
      table.add(own);
    }
}

void declare_vessels(Scene& scene) {
  ParameterTable& table = scene.parameters;
  struct Vessel {
    double resistance, compliance, inertance;
    const char* source;
  };
  const bool tissue = ventricles_of_tissue(scene);
  const std::array<Vessel, 4> vessels = {
      {{tissue ? 0.65 : 0.733, 1.372, 0.005, regazzoni},
       {0.32, 11.363, 0.0005, regazzoni},
       {tissue ? 0.06 : 0.046, tissue ? 10. : 20., 0.0005, tissue ? before_ventricles : regazzoni},
       // With 0.0015 the left atrium empties back into the veins at 3 Hz (solver/README.md).
       {tissue ? 0.03 : 0.0015, 16, 0.0005, regazzoni}}};
  for (std::size_t k = 0; k < vessels.size(); ++k) {
    const std::string root = std::string("circulation.") + vessel_names[k];
    table.add({root + "_resistance_mmHg_s_per_mL", "mmHg s/mL", vessels[k].resistance, 1e-4, 50, "resistance",
               tissue ? before_ventricles : regazzoni});
    table.add({root + "_compliance_mL_per_mmHg", "mL/mmHg", vessels[k].compliance, 0.01, 500, "compliance",
               vessels[k].source});
    table.add({root + "_inertance_mmHg_s2_per_mL", "mmHg s2/mL", vessels[k].inertance, 0, 1,
               "inertance of the blood", regazzoni});
  }
}

void declare_windkessel(Scene& scene) {
  ParameterTable& table = scene.parameters;
  const std::string root = "circulation.windkessel.";
  const char* source = "systemic circulation of Regazzoni et al. 2022";
  const bool tissue = ventricles_of_tissue(scene);
  table.add({root + "peripheral_resistance_mmHg_s_per_mL", "mmHg s/mL", tissue ? 0.97 : 1.053, 1e-3, 50,
             "from the arteries to the veins",
             tissue ? "both systemic vessels of the closed loop before ventricles of tissue" : source});
  table.add({root + "compliance_mL_per_mmHg", "mL/mmHg", 1.372, 0.01, 500, "of the arteries", source});
  table.add({root + "characteristic_resistance_mmHg_s_per_mL", "mmHg s/mL", 0.05, 0, 10,
             "impedance of the aorta, between the valve and the compliance",
             "chosen, 5 % of the resistance"});
  table.add({root + "filling_pressure_mmHg", "mmHg", 10, -20, 100, "behind the mitral valve", by_choice});
  table.add(
      {root + "venous_pressure_mmHg", "mmHg", 5, -20, 100, "behind the peripheral resistance", by_choice});
}

// Blood and flows at the start: of Regazzoni's, or of a periodic beat with ventricles of tissue.
void declare_start(Scene& scene) {
  ParameterTable& table = scene.parameters;
  const std::string root = "circulation.initial.";
  const bool tissue = ventricles_of_tissue(scene);
  const char* source = tissue ? "a periodic beat with ventricles of tissue" : regazzoni;
  const std::array<double, chamber_count> volumes = {118.520, 166.177, tissue ? 31.6 : 87.183,
                                                     tissue ? 34 : 86.833};
  for (std::size_t q = 0; q < chambers_of(scene); ++q)
    if (!is_tissue(scene, static_cast<Chamber>(q)))
      table.add(
          {root + chamber_names[q] + "_volume_mL", "mL", volumes[q], 0, 1000, "volume at the start", source});
  if (!closed_loop(scene)) {
    table.add({root + "arterial_pressure_mmHg", "mmHg", 80, 0, 300, "pressure at the start", by_choice});
    return;
  }
  const std::array<double, 4> pressures = tissue ? std::array<double, 4>{95, 37.2, 13.8, 8.4}
                                                 : std::array<double, 4>{87.675, 35.898, 19.545, 15.004},
                              flows = tissue ? std::array<double, 4>{90, 109.5, 91, 139}
                                             : std::array<double, 4>{71.104, 94.039, 94.084, 473.279};
  // Behind the veins an atrium of tissue is at rest; a flow that begins at once would jolt it.
  const std::array<bool, 4> into_tissue = {false, is_tissue(scene, Chamber::ra), false,
                                           is_tissue(scene, Chamber::la)};
  for (std::size_t k = 0; k < 4; ++k) {
    std::string name = vessel_names[k];
    std::replace(name.begin(), name.end(), '.', '_');
    table.add(
        {root + name + "_pressure_mmHg", "mmHg", pressures[k], -20, 300, "pressure at the start", source});
    table.add({root + name + "_flow_mL_per_s", "mL/s", into_tissue[k] ? 0 : flows[k], -5000, 5000,
               "flow at the start", source});
  }
}

}  // namespace

void declare_circulation(Scene& scene) {
  if (scene.beats && !scene.circulation)
    throw std::invalid_argument(
        "time.beats: beats are compared by their pressures and volumes; add circulation");
  if (!scene.circulation) return;
  declare_beat(scene);
  declare_chambers(scene);
  declare_valves(scene);
  if (closed_loop(scene))
    declare_vessels(scene);
  else
    declare_windkessel(scene);
  declare_start(scene);
  if (any_tissue(scene)) return;
  Parameter dt{"circulation.dt_ms", "ms", 1, 1e-4, 20, "largest step", "measured: solver/README.md"};
  dt.structural = true;
  scene.parameters.add(dt);
}

double beat_ms(const Scene& scene) {
  return scene.parameters.value(scene.beats ? "time.beats.length_ms" : "time.beat_ms");
}

int most_beats(const Scene& scene) {
  if (scene.beats) return static_cast<int>(std::lround(scene.parameters.value("time.beats.at_most")));
  return static_cast<int>(std::ceil(scene.parameters.value("time.end_ms") / beat_ms(scene) - 1e-9));
}

bool is_tissue(const Scene& scene, Chamber chamber) {
  const std::string name = chamber_names[static_cast<std::size_t>(chamber)];
  return scene.mechanics && std::any_of(scene.mechanics->cavities.begin(), scene.mechanics->cavities.end(),
                                        [&](const Mechanics::Cavity& cavity) { return cavity.name == name; });
}

std::string circulation_defect(const Scene& scene, std::span<const double> values) {
  const auto value = [&](const std::string& path) {
    return values[static_cast<std::size_t>(scene.parameters.index(path))];
  };
  std::ostringstream text;
  for (std::size_t q = 0; q < chambers_of(scene); ++q) {
    if (is_tissue(scene, static_cast<Chamber>(q))) continue;
    const std::string root = std::string("circulation.") + chamber_names[q];
    const double length = value(root + ".contraction_ms") + value(root + ".relaxation_ms");
    if (length > beat_ms(scene)) {
      text << root << ".contraction_ms and .relaxation_ms are " << length
           << " ms together, longer than the beat of " << beat_ms(scene) << " ms";
      return text.str();
    }
  }
  for (std::size_t v = 0; v < valves_of(scene); ++v) {
    const std::string root = std::string("circulation.valves.") + valve_names[v];
    const double closed = value(root + ".closed_resistance_mmHg_s_per_mL");
    double open = value(root + ".open_resistance_mmHg_s_per_mL");
    if (v == 1 && !closed_loop(scene))
      open += value("circulation.windkessel.characteristic_resistance_mmHg_s_per_mL");
    if (closed <= open) {
      text << root << ".closed_resistance_mmHg_s_per_mL is " << closed << ", no more than the " << open
           << " mmHg s/mL of the way through the open valve";
      return text.str();
    }
  }
  return {};
}

std::string circulation_tables(const Scene& scene, bool single) {
  const ParameterTable& table = scene.parameters;
  const auto list = [](const std::string& name, const std::vector<int>& numbers) {
    std::string text = "constant int " + name + "[] = {";
    for (const int number : numbers) text += std::to_string(number) + ",";
    return text + "};\n";
  };
  std::vector<int> chambers, valves, vessels, nodes, edges;
  for (std::size_t q = 0; q < chamber_count; ++q)
    chambers.push_back(
        table.find(std::string("circulation.") + chamber_names[q] + ".active_elastance_mmHg_per_mL"));
  for (const char* valve : valve_names)
    valves.push_back(
        table.find(std::string("circulation.valves.") + valve + ".open_resistance_mmHg_s_per_mL"));
  for (std::size_t q = 0; q < chambers_of(scene); ++q)
    nodes.push_back(table.find(std::string("circulation.initial.") + chamber_names[q] + "_volume_mL"));
  std::string text = "#define CIRCULATION_TABLES\n";
  if (single) text += "#define CIRCULATION_SINGLE\n";
  if (closed_loop(scene)) {
    for (const char* vessel : vessel_names) {
      vessels.push_back(table.index(std::string("circulation.") + vessel + "_resistance_mmHg_s_per_mL"));
      std::string name = vessel;
      std::replace(name.begin(), name.end(), '.', '_');
      nodes.push_back(table.index("circulation.initial." + name + "_pressure_mmHg"));
      edges.push_back(table.index("circulation.initial." + name + "_flow_mL_per_s"));
    }
    text += "#define COMPARTMENTS 6\n";
  } else {
    vessels = {table.index("circulation.windkessel.peripheral_resistance_mmHg_s_per_mL"), -1, -1, -1};
    nodes.push_back(table.index("circulation.initial.arterial_pressure_mmHg"));
    nodes.push_back(-1);
    edges = {-1};
    text += "#define COMPARTMENTS 2\n#define WINDKESSEL\n#define WINDKESSEL_FIRST " +
            std::to_string(table.index("circulation.windkessel.characteristic_resistance_mmHg_s_per_mL")) +
            "\n";
  }
  text += "#define OPENING_PRESSURE " +
          std::to_string(table.index("circulation.valves.opening_pressure_mmHg")) + "\n";
  text += "#define STEP_FACTOR " + std::to_string(table.index("time.step_factor")) + "\n";
  text += "#define HEART_STATE_BYTES " + std::to_string(heart_state_bytes) + "\n";
  return text + list("chamber_first", chambers) + list("valve_first", valves) +
         list("vessel_first", vessels) + list("initial_node", nodes) + list("initial_edge", edges);
}

}  // namespace cohort
