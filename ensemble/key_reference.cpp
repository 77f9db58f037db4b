#include "ensemble/key_reference.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "solver/cell_models.hpp"
#include "solver/conduction_system.hpp"
#include "solver/labels.hpp"
#include "solver/mechanics.hpp"
#include "solver/mechanics_structure.hpp"

// The page of all keys. Parameters are those of scenes that have every kind of structure; nothing about them
// is written here.
namespace cohort {

namespace {

struct Row {
  Parameter parameter;
  std::vector<std::string> components;                       ///< of a vector
  std::vector<std::pair<std::string, std::string>> by_name;  ///< where the default depends on the name
  std::string alone;                                         ///< default in a circulation without tissue
};

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> keys;
  std::istringstream stream(path);
  for (std::string key; std::getline(stream, key, '.');) keys.push_back(key);
  return keys;
}

std::string joined(const std::vector<std::string>& keys) {
  return fmt::format("{}", fmt::join(keys, "."));
}

/// Levels whose keys are names of the user's.
bool holds_names(const std::string& level) {
  constexpr std::array levels = {"geometry.shapes",
                                 "geometry.regions",
                                 "geometry.labels_table",
                                 "electrophysiology.regions",
                                 "electrophysiology.conduction_system.early_sites",
                                 "stimuli",
                                 "mechanics.cavities",
                                 "mechanics.boundary",
                                 "mechanics.regions",
                                 "outputs.displacement.points",
                                 "outputs.activation.probes"};
  return std::find(levels.begin(), levels.end(), level) != levels.end();
}

Scene heart() {
  Scene scene;
  scene.conduction_system.emplace().early_sites = default_early_sites();
  scene.heterogeneity.parameters = {"tau_close_ms"};
  scene.ecg.emplace();
  scene.activation.emplace().probes = {"apex"};
  scene.pv.emplace();
  scene.displacement.emplace().points = {"apex"};
  scene.mechanics = default_heart_mechanics();
  scene.circulation.emplace();
  scene.stimuli = {{"a", Stimulus::Kind::box, {}},
                   {"b", Stimulus::Kind::sphere, {}},
                   {"c", Stimulus::Kind::site, "sinoatrial_node"}};
  return scene;
}

/// Shapes of every kind, in a bath, by the bidomain equations.
Scene shapes() {
  using Kind = Shape::Kind;
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.activation_method = ActivationMethod::bidomain;
  for (const Kind kind :
       {Kind::box, Kind::ellipsoid, Kind::cylinder, Kind::cone, Kind::capsule, Kind::half_space})
    scene.shapes.push_back({"s" + std::to_string(scene.shapes.size()), kind, {}});
  scene.shapes.push_back({"sum", Kind::smooth_union, {"s0", "s1"}});
  scene.shapes.push_back({"skin", Kind::shell, {"s0"}});
  Region muscle{.name = "muscle", .shape = "skin"};
  muscle.fibres = Region::Fibres::transmural;
  Region bath{.name = "bath", .shape = "s0", .excitable = false};
  bath.bath = true;
  scene.regions = {muscle, bath};
  scene.mechanics.emplace().cavities = {{"cavity", "s0"}};
  scene.mechanics->quasi_static = true;
  scene.mechanics->tension = "nash_panfilov";  // its cells' potential drives it
  scene.stretch_activated = true;
  return scene;
}

/// A circulation alone.
Scene circulation(Circulation::Kind kind, bool beats) {
  Scene scene;
  scene.geometry = GeometryKind::none;
  scene.circulation.emplace().kind = kind;
  scene.pv.emplace();
  if (beats) scene.beats.emplace();
  return scene;
}

/// A label map of blood alone but for one wall: everything else is grown.
Scene labels() {
  LabelImage image;
  image.cells = {5, 1, 1};
  image.labels = {1, 2, 3, 4, 5};
  image.counts = {1, 1, 1, 1, 1};
  image.voxels = {0, 1, 2, 3, 4};
  LabelTable table = {{1, "lv_blood"}, {2, "rv_blood"}, {3, "la_blood"}, {4, "ra_blood"}, {5, "lv"}};
  Scene scene;
  scene.geometry = GeometryKind::labels;
  scene.labels =
      std::make_shared<LabelHeart>(std::move(image), "labels", "", std::move(table), LabelFrame::image);
  Mechanics& mechanics = scene.mechanics.emplace(default_heart_mechanics());
  mechanics.cavities = {{"lv", {}}, {"rv", {}}, {"la", {}}, {"ra", {}}};
  mechanics.boundary = default_heart_boundary(mechanics);
  scene.circulation.emplace();
  return scene;
}

std::vector<Scene> all_scenes() {
  std::vector<Scene> scenes = {heart(), heart(), shapes(), labels()};
  scenes[1].geometry = GeometryKind::box;
  scenes[1].conduction_system.reset();
  scenes[1].heterogeneity = {};
  scenes[1].stimuli.pop_back();
  scenes[1].mechanics.reset();
  scenes[1].displacement.reset();
  scenes[1].activation_method = ActivationMethod::monodomain;
  for (const TorsoKind torso : {TorsoKind::box, TorsoKind::ellipsoid, TorsoKind::unbounded}) {
    scenes.push_back(scenes[1]);
    scenes.back().torso = torso;
  }
  scenes.push_back(circulation(Circulation::Kind::closed_loop, true));
  scenes.push_back(circulation(Circulation::Kind::windkessel, false));
  for (Scene& scene : scenes) declare_parameters(scene);
  return scenes;
}

/// Whether a parameter repeats, for one region, one that stands right below electrophysiology or mechanics,
/// or in a model or law of theirs.
bool is_copy(const std::string& pattern) {
  return (pattern.starts_with("electrophysiology.regions.NAME.") &&
          !pattern.ends_with("bath_conductivity_mS_per_mm")) ||
         pattern.starts_with("mechanics.regions.NAME.");
}

std::string default_of(const Parameter& p) {
  if (!std::isnan(p.value) || p.inherits.empty()) return fmt::format("{:.6g}", p.value);
  return p.inherits_factor == 1 ? fmt::format("`{}`", p.inherits)
                                : fmt::format("{:.6g} `{}`", p.inherits_factor, p.inherits);
}

/// The user's name in `path`.
std::string name_in(const std::string& path, const std::string& pattern) {
  const std::vector<std::string> given = split(path), keys = split(pattern);
  const auto at = static_cast<size_t>(std::find(keys.begin(), keys.end(), "NAME") - keys.begin());
  return at < keys.size() ? given[at] : std::string();
}

void add(const Parameter& parameter, const std::string& path, bool tissue, std::vector<std::string>& order,
         std::map<std::string, Row>& rows) {
  const std::string pattern = key_pattern(path);
  if (is_copy(pattern)) return;
  const auto [it, added] = rows.try_emplace(pattern, Row{parameter, {}, {}, {}});
  if (added) order.push_back(pattern);
  Row& row = it->second;
  if (!tissue && default_of(parameter) != default_of(row.parameter)) row.alone = default_of(parameter);
  constexpr std::array axes = {".x", ".y", ".z"};
  if (row.components.size() < axes.size() && path.ends_with(axes[row.components.size()]))
    row.components.push_back(default_of(parameter));
  const std::string name = name_in(path, pattern);
  const auto known = [&](const auto& other) { return other.first == name; };
  if (!name.empty() && std::none_of(row.by_name.begin(), row.by_name.end(), known))
    row.by_name.emplace_back(name, default_of(parameter));
}

std::string default_of(const Row& row) {
  if (!row.components.empty()) return fmt::format("[{}]", fmt::join(row.components, ", "));
  if (!row.alone.empty())
    return fmt::format("{}; {} in a circulation alone", default_of(row.parameter), row.alone);
  const auto other = [&](const auto& named) { return named.second != row.by_name.front().second; };
  if (std::none_of(row.by_name.begin(), row.by_name.end(), other)) return default_of(row.parameter);
  std::string text;
  for (const auto& [name, value] : row.by_name)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, value);
  return text;
}

/// Text with `from` to the next space or comma replaced; names of the scenes above are none of the user's.
std::string replaced(std::string text, const std::string& from, const std::string& by) {
  const size_t at = text.find(from);
  if (at == std::string::npos) return text;
  const size_t end = std::min(text.find_first_of(" ,", at + from.size()), text.size());
  return text.replace(at, end - at, by);
}

std::string meaning_of(const std::string& path, const Parameter& parameter) {
  std::string text = replaced(parameter.meaning, " of shape ", "");
  if (const size_t at = text.find(",,"); at != std::string::npos) text.erase(at, 1);
  if (path.find(".PARAMETER.") != std::string::npos)
    text = replaced(text, "change of ", "change of PARAMETER");
  for (size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2))
    text.insert(at, "\\");
  return text;
}

std::string table(const std::vector<std::string>& paths, const std::map<std::string, Row>& rows) {
  std::string text = "| key | unit | default | range | meaning |\n|---|---|---|---|---|\n";
  for (const std::string& path : paths) {
    const Row& row = rows.at(path);
    const Parameter& p = row.parameter;
    const bool of_parameter = path.find(".PARAMETER.") != std::string::npos;
    text += fmt::format("| `{}`{} | {} | {} | {} | {} |\n", path, p.structural ? " *" : "",
                        of_parameter    ? "PARAMETER's"
                        : p.unit == "1" ? "-"
                                        : p.unit,
                        default_of(row),
                        of_parameter ? "the width of PARAMETER's, to both sides"
                                     : fmt::format("{:.6g} to {:.6g}", p.lower, p.upper),
                        meaning_of(path, p));
  }
  return text;
}

struct Parameters {
  std::vector<std::string> order;
  std::map<std::string, Row> rows;
};

const Parameters& all_parameters() {
  static const Parameters parameters = [] {
    Parameters result;
    for (const Scene& scene : all_scenes())
      for (const Parameter& parameter : scene.parameters.all())
        add(parameter, parameter.path, scene.geometry != GeometryKind::none, result.order, result.rows);
    for (const std::string& model : cell_models())
      for (const Parameter& parameter : read_cell_model(model).parameters)
        add(parameter, "electrophysiology." + model + "." + parameter.path, true, result.order, result.rows);
    const auto add_material = [&](const MaterialFile& file) {
      for (const Parameter& parameter : file.parameters)
        add(parameter, "mechanics." + file.name + "." + parameter.path, true, result.order, result.rows);
    };
    for (const std::string& law : laws()) add_material(read_law(law));
    for (const std::string& tension : tensions()) add_material(read_tension(tension));
    return result;
  }();
  return parameters;
}

/// The section of the page that a parameter stands in: one for each cell model, else the first two keys.
std::string section_of(const std::string& pattern) {
  const std::vector<std::string> keys = split(pattern);
  if (keys.size() < 2 || keys[0] == "grid" || keys[0] == "time") return "grid, time";
  const bool two = keys[0] == "geometry" || (keys[0] == "circulation" && keys.size() > 2) ||
                   (keys[0] == "mechanics" && keys.size() > 2) ||
                   (keys[0] == "electrophysiology" && keys.size() > 2);
  return two ? keys[0] + "." + keys[1] : keys[0];
}

}  // namespace

std::string key_pattern(const std::string& path) {
  std::vector<std::string> keys = split(path);
  if (keys.size() > 1 && (keys.back() == "x" || keys.back() == "y" || keys.back() == "z")) keys.pop_back();
  if (keys[0] == "parameters" && keys.size() > 2) return "parameters.PATH." + keys.back();
  if (keys[0] == "accuracy" && keys.size() == 2 && keys[1] != "measurements") return "accuracy.FEATURE";
  std::string level = keys[0];
  for (size_t k = 1; k < keys.size(); ++k) {
    const std::string key = keys[k];
    if (holds_names(level))
      keys[k] = level == "outputs.activation.probes" || level == "outputs.displacement.points" ? "NAME_mm"
                : level == "geometry.labels_table"                                             ? "VALUE"
                                                                                               : "NAME";
    if (level == "electrophysiology.heterogeneity" && k + 1 < keys.size()) keys[k] = "PARAMETER";
    level += "." + key;
  }
  return joined(keys);
}

bool is_documented(const std::string& path) {
  static const std::set<std::string> known = [] {
    std::set<std::string> result;
    const auto with_levels = [&](std::string key) {
      for (result.insert(key); key.find('.') != std::string::npos; result.insert(key))
        key.resize(key.rfind('.'));
    };
    for (const StructureKey& key : structure_keys()) with_levels(key.path);
    for (const std::string& key : all_parameters().order) with_levels(key);
    return result;
  }();
  const std::string pattern = key_pattern(path);
  if (known.contains(pattern)) return true;
  const auto is_own = [&](const std::string& section, const std::vector<std::string>& models) {
    const std::string of_region = section + ".regions.NAME.";
    if (!pattern.starts_with(of_region)) return false;
    const std::string own = pattern.substr(of_region.size());
    return known.contains(section + "." + own) ||
           std::any_of(models.begin(), models.end(), [&](const std::string& model) {
             return known.contains(section + "." + model + "." + own);
           });
  };
  return is_own("electrophysiology", cell_models()) || is_own("mechanics", laws()) ||
         is_own("mechanics", tensions());
}

std::string key_reference() {
  std::string text =
      "# Keys of a campaign file\n\n"
      "Written by `cohort keys`; a test holds it to what the program reads. What the keys do together is in\n"
      "`configs/README.md`; `cohort parameters FILE` lists the parameters of one file with their sources.\n\n"
      "A path is the keys from the section down, joined by dots: `grid.dx_mm` is `scene: {grid: {dx_mm: "
      "2}}`, and the name\n"
      "in `--set`, `parameters` and the HDF5 file. NAME is a name of yours, PATH that of a parameter, "
      "PARAMETER one\n"
      "of the cell model's. Lengths are in mm, times in ms.\n\n"
      "## Structure\n\n"
      "| key | takes | unless given | meaning |\n|---|---|---|---|\n";
  for (const StructureKey& key : structure_keys())
    text += fmt::format("| `{}` | {} | {} | {} |\n", key.path, key.takes, key.unless_given, key.meaning);
  text +=
      "\n## Parameters\n\n"
      "Numbers. Each may be sampled but for those marked *, which all members share.\n";
  const Parameters& parameters = all_parameters();
  std::vector<std::string> sections;
  std::map<std::string, std::vector<std::string>> members;
  for (const std::string& path : parameters.order) {
    const std::string section = section_of(path);
    if (!members.contains(section)) sections.push_back(section);
    members[section].push_back(path);
  }
  for (const std::string& section : sections)
    text += fmt::format("\n### {}\n\n{}", section, table(members.at(section), parameters.rows));
  return text;
}

}  // namespace cohort
