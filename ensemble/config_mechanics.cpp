#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/suggest.hpp"
#include "solver/labels.hpp"
#include "solver/mechanics.hpp"
#include "solver/mechanics_structure.hpp"

// mechanics, circulation and time.beats: their structure; numbers are left for read_parameters.
namespace cohort {

namespace {

const std::vector<std::string> chambers(std::begin(chamber_names), std::end(chamber_names));

bool windkessel(const Scene& scene) {
  return scene.circulation && scene.circulation->kind == Circulation::Kind::windkessel;
}

bool holds(const std::vector<Mechanics::Cavity>& cavities, const std::string& name) {
  return std::any_of(cavities.begin(), cavities.end(),
                     [&](const Mechanics::Cavity& cavity) { return cavity.name == name; });
}

/// "none" counts as no circulation, also where the geometry has one unless told otherwise.
void read_circulation(Node& scene_node, Scene& scene, Mistakes& mistakes) {
  Node* node = take(scene_node, "circulation");
  if (!node) {
    if (scene.geometry == GeometryKind::heart ||
        (scene.geometry == GeometryKind::labels && scene_node.find("mechanics")))
      scene.circulation.emplace();
    return;
  }
  if (node->kind == Node::Kind::scalar && node->text == "none") {
    node->read = true;
    return;
  }
  if (node->kind == Node::Kind::scalar) {
    node->read = true;
    mistakes.add(node->place, fmt::format("circulation must be a map of keys or none, {}", found(*node)));
  } else if (!expect_map(*node, node->name, mistakes)) {
    return;
  }
  using Kind = Circulation::Kind;
  scene.circulation.emplace();
  if (Node* kind = node->read ? nullptr : take(*node, "kind"))
    scene.circulation->kind =
        read_word<Kind>(*kind, {{"closed_loop", Kind::closed_loop}, {"windkessel", Kind::windkessel}},
                        scene.circulation->kind, mistakes);
}

/// A cavity that blood of the circulation fills is one of its chambers.
void check_chamber(const std::string& name, const Place& place, const Scene& scene, Mistakes& mistakes) {
  if (std::find(chambers.begin(), chambers.end(), name) == chambers.end())
    mistakes.add(place, fmt::format("mechanics.cavities: \"{}\" is no chamber of the {}{}", name,
                                    scene.circulation ? "circulation" : "heart", suggestion(name, chambers)));
  else if (windkessel(scene) && name != "lv")
    mistakes.add(place,
                 fmt::format("mechanics.cavities: the windkessel has the chamber lv alone, not {}", name));
}

/// Whether a label map has blood of the chamber; other hearts have all.
bool has_blood(const Scene& scene, const std::string& chamber) {
  if (!scene.labels) return true;
  const auto it = std::find(chambers.begin(), chambers.end(), chamber);
  return it != chambers.end() &&
         scene.labels->has_blood(static_cast<Part>(lv_blood_part + (it - chambers.begin())));
}

/// The heart, or a label map of one: a list of its chambers.
void read_chambers(Node& node, const Scene& scene, Mechanics& mechanics, Mistakes& mistakes) {
  if (node.kind == Node::Kind::map) {
    node.read = true;
    mistakes.add(node.place,
                 "mechanics.cavities of the heart is a list of chambers, as [lv, rv]; shapes are of "
                 "geometry.shapes");
    return;
  }
  if (node.kind == Node::Kind::null) {
    node.read = true;
    return;
  }
  const auto names = read_texts(node, node.path, mistakes);
  for (const std::string& name : names.value_or(std::vector<std::string>())) {
    if (holds(mechanics.cavities, name)) {
      mistakes.add(node.place, fmt::format("mechanics.cavities names \"{}\" twice", name));
      continue;
    }
    const size_t before = mistakes.size();
    check_chamber(name, node.place, scene, mistakes);
    if (mistakes.size() == before && !has_blood(scene, name))
      mistakes.add(node.place, fmt::format("mechanics.cavities: the label map has no blood of {}", name));
    mechanics.cavities.push_back({name, {}});
  }
}

/// Shapes: NAME: {shape: NAME}.
void read_cavities(Node& node, const Scene& scene, Mechanics& mechanics, Mistakes& mistakes) {
  if (node.kind == Node::Kind::sequence) {
    node.read = true;
    mistakes.add(
        node.place,
        "mechanics.cavities of shapes is a map, NAME: {shape: NAME}; a list of chambers is the heart's");
    return;
  }
  if (!expect_map(node, node.path, mistakes)) return;
  const std::vector<std::string> shapes = boundary_surfaces(scene);
  for (Node::Entry& entry : node.entries) {
    node.known.insert(entry.key);
    if (!check_name(entry, "a cavity", mistakes) || !expect_map(entry.value, entry.value.path, mistakes)) {
      entry.value.read = true;
      continue;
    }
    if (scene.circulation) check_chamber(entry.key, entry.place, scene, mistakes);
    Mechanics::Cavity cavity{entry.key, {}};
    if (Node* shape = take(entry.value, "shape")) {
      if (const auto index = read_choice(*shape, shape->path, shapes, mistakes))
        cavity.shape = shapes[*index];
    } else {
      entry.value.read = true;
      mistakes.add(entry.place, fmt::format("\"shape\" is missing in {}: the shape that the cavity fills",
                                            entry.value.path));
    }
    if (Node* pressure = take(entry.value, "pressure")) {
      using Pressure = Mechanics::Cavity::Pressure;
      cavity.pressure =
          read_word<Pressure>(*pressure, {{"constant", Pressure::constant}, {"bestel", Pressure::bestel}},
                              cavity.pressure, mistakes);
      if (scene.circulation)
        mistakes.add(pressure->place,
                     fmt::format("{} is that of the circulation; write circulation: none", pressure->path));
      else if (cavity.pressure == Pressure::bestel && mechanics.tension != "bestel")
        mistakes.add(pressure->place,
                     fmt::format("{}: bestel shares its numbers with the active tension; write "
                                 "mechanics.tension: bestel",
                                 pressure->path));
    }
    mechanics.cavities.push_back(std::move(cavity));
  }
}

void read_condition(Node::Entry& entry, const std::vector<std::string>& surfaces, Mechanics& mechanics,
                    Mistakes& mistakes) {
  using Kind = Mechanics::Boundary::Kind;
  Node& node = entry.value;
  if (!check_name(entry, "a boundary condition", mistakes) || !expect_map(node, node.path, mistakes)) {
    node.read = true;
    return;
  }
  node.known.insert({"surface", "stiffness_kPa_per_mm", "damping_kPa_ms_per_mm"});
  const size_t before = mistakes.size();
  Mechanics::Boundary condition{entry.key, {}, Kind::clamp};
  if (Node* surface = take(node, "surface")) {
    if (const auto index = read_choice(*surface, surface->path, surfaces, mistakes))
      condition.surface = surfaces[*index];
  } else {
    mistakes.add(entry.place,
                 fmt::format("\"surface\" is missing in {}{}", node.path, suggestion("", surfaces)));
  }
  if (Node::Entry* kind = exactly_one(node, {"clamp", "spring"}, mistakes)) {
    condition.kind =
        kind->key == "clamp"
            ? read_word<Kind>(kind->value, {{"all", Kind::clamp}, {"normal", Kind::clamp_normal}},
                              condition.kind, mistakes)
            : read_word<Kind>(kind->value, {{"full", Kind::spring}, {"normal", Kind::spring_normal}},
                              condition.kind, mistakes);
  }
  if (mistakes.size() > before) node.read = true;  // its numbers depend on what is wrong
  mechanics.boundary.push_back(std::move(condition));
}

/// A condition that is a default by its name and gives numbers alone keeps its surface and its kind; where
/// all of them are such, the other defaults stay.
void read_boundary(Node& node, const Scene& scene, Mechanics& mechanics, Mistakes& mistakes) {
  const std::vector<Mechanics::Boundary> defaults = mechanics.boundary;
  const auto default_of = [&](Node::Entry& entry) {
    Node& value = entry.value;
    const bool numbers = value.kind == Node::Kind::map && !value.find("surface") && !value.find("clamp") &&
                         !value.find("spring");
    return std::find_if(defaults.begin(), defaults.end(), [&](const Mechanics::Boundary& condition) {
      return numbers && condition.name == entry.key;
    });
  };
  const bool numbers_alone =
      !node.entries.empty() && std::all_of(node.entries.begin(), node.entries.end(), [&](Node::Entry& entry) {
        return default_of(entry) != defaults.end();
      });
  if (!numbers_alone) mechanics.boundary.clear();
  for (Node::Entry& entry : node.entries) {
    node.known.insert(entry.key);
    if (const auto condition = default_of(entry); condition == defaults.end())
      read_condition(entry, boundary_surfaces(scene), mechanics, mistakes);
    else {
      if (!numbers_alone) mechanics.boundary.push_back(*condition);
    }
  }
}

void read_law(Node& node, Mechanics& mechanics, Mistakes& mistakes) {
  if (Node* law = take(node, "law")) {
    const std::vector<std::string> known = laws();
    if (const auto index = read_choice(*law, law->path, known, mistakes))
      mechanics.law = known[*index];
    else
      node.read = true;  // its numbers depend on what is wrong
  }
  if (Node* tension = take(node, "tension")) {
    std::vector<std::string> known = tensions();
    known.emplace_back("none");
    if (const auto index = read_choice(*tension, tension->path, known, mistakes))
      mechanics.tension = known[*index] == "none" ? "" : known[*index];
    else
      node.read = true;
  }
}

/// Tells sections of laws and tensions that the scene does not have.
void refuse_other_materials(Node& node, const Mechanics& mechanics, Mistakes& mistakes) {
  const auto refuse = [&](const std::vector<std::string>& names, const std::string& used, const char* kind) {
    for (const std::string& name : names) {
      Node* section = name == used ? nullptr : node.find(name);
      if (!section) continue;
      section->read = true;
      node.known.insert(name);
      mistakes.add(section->place,
                   fmt::format("mechanics.{} is {}; the parameters of {} would have no effect", kind,
                               used.empty() ? "none" : used, name));
    }
  };
  refuse(laws(), mechanics.law, "law");
  refuse(tensions(), mechanics.tension, "tension");
}

/// Mechanics of the heart are there unless told otherwise, those of shapes and label maps where they are
/// asked for.
void read_mechanics(Node& scene_node, Scene& scene, Mistakes& mistakes) {
  const bool heart = scene.geometry == GeometryKind::heart || scene.geometry == GeometryKind::labels;
  Node* node = take(scene_node, "mechanics");
  if (node && scene.geometry == GeometryKind::box) {
    mistakes.add(node->place, "mechanics: a box has no named surfaces; make it one of geometry.shapes");
    node->read = true;
    return;
  }
  if (node && !expect_map(*node, node->name, mistakes)) return;
  if (!node && scene.geometry != GeometryKind::heart) return;
  if (scene.geometry == GeometryKind::labels && !scene.labels) {
    node->read = true;  // its chambers depend on what is wrong
    return;
  }
  Mechanics& mechanics = scene.mechanics.emplace();
  if (heart) {
    mechanics = default_heart_mechanics(windkessel(scene));
    std::erase_if(mechanics.cavities,
                  [&](const Mechanics::Cavity& cavity) { return !has_blood(scene, cavity.name); });
  }
  if (!node) return;

  read_law(*node, mechanics, mistakes);
  if (!node->read) refuse_other_materials(*node, mechanics, mistakes);
  take(*node, "regions");
  if (Node* cavities = take(*node, "cavities")) {
    mechanics.cavities.clear();
    if (heart)
      read_chambers(*cavities, scene, mechanics, mistakes);
    else
      read_cavities(*cavities, scene, mechanics, mistakes);
  }
  if (heart) mechanics.boundary = default_heart_boundary(mechanics);
  if (Node* given = node->find("boundary"); given && given->kind == Node::Kind::null)
    mistakes.add(given->place, "mechanics.boundary: found nothing; {} is tissue that nothing holds");
  if (Node* boundary = take_map(*node, "boundary", mistakes))
    read_boundary(*boundary, scene, mechanics, mistakes);
  if (Node* still = take(*node, "quasi_static")) {
    mechanics.quasi_static = read_bool(*still, still->path, mistakes).value_or(false);
    if (mechanics.quasi_static && scene.circulation)
      mistakes.add(still->place,
                   "mechanics.quasi_static: an equilibrium has no beats; write circulation: none");
  }
}

void read_beats(Node& scene_node, Scene& scene, Mistakes& mistakes) {
  Node* time = take_map(scene_node, "time", mistakes);
  Node* beats = time ? take_map(*time, "beats", mistakes) : nullptr;
  if (!beats) return;
  if (!scene.circulation) {
    mistakes.add(beats->place,
                 "time.beats: beats are compared by their pressures and volumes; add a circulation");
    beats->read = true;
    return;
  }
  if (Node* end = time->find("end_ms")) {
    time->known.insert("end_ms");
    end->read = true;
    mistakes.add(end->place,
                 "time.end_ms beside time.beats: a run of beats ends with the last of them; "
                 "time.beats.length_ms and at_most say how long it may be");
  }
  scene.beats.emplace();
}

/// Tells what an output needs and the scene has not.
void check_needs(Node& outputs, const Scene& scene, Mistakes& mistakes) {
  const bool cavity = scene.mechanics && !scene.mechanics->cavities.empty();
  if (Node* pv = outputs.find("pv"); pv && scene.pv && !scene.circulation && !cavity)
    mistakes.add(pv->place, "outputs.pv needs a circulation, or mechanics with a cavity");
  if (Node* displacement = outputs.find("displacement");
      displacement && scene.displacement && scene.geometry != GeometryKind::none && !scene.mechanics)
    mistakes.add(displacement->place, "outputs.displacement needs mechanics");
}

/// Tells what needs tissue.
void check_without_tissue(Node& scene_node, Node* outputs, Mistakes& mistakes) {
  const auto refuse = [&](Node& level, const std::string& key, const std::string& name) {
    Node* node = level.find(key);
    if (!node) return;
    level.known.insert(key);
    node->read = true;
    mistakes.add(node->place, name + " needs tissue; the geometry is none");
  };
  for (const char* key : {"grid", "electrophysiology", "stimuli", "torso", "mechanics"})
    refuse(scene_node, key, key);
  for (const char* key : {"ecg", "activation", "displacement"})
    if (outputs) refuse(*outputs, key, std::string("outputs.") + key);
}

}  // namespace

void read_loads(Node& scene_node, Node* outputs, Scene& scene, Mistakes& mistakes) {
  const size_t before = mistakes.size();
  read_circulation(scene_node, scene, mistakes);
  if (scene.geometry == GeometryKind::none) {
    check_without_tissue(scene_node, outputs, mistakes);
    scene.ecg.reset();
    scene.activation.reset();
    scene.displacement.reset();
    if (!scene.circulation && mistakes.size() == before)
      mistakes.add(scene_node.find("geometry")->place,
                   "geometry: none has no tissue; it needs a circulation");
  } else {
    read_mechanics(scene_node, scene, mistakes);
  }
  const bool sound = mistakes.size() == before;
  Node* electrophysiology = scene_node.find("electrophysiology");
  Node* stretched = electrophysiology ? electrophysiology->find("stretch_activated") : nullptr;
  if (sound && stretched && scene.stretch_activated && (!scene.mechanics || scene.mechanics->tension.empty()))
    mistakes.add(
        stretched->place,
        "electrophysiology.stretch_activated: no tissue stretches; it needs mechanics with a tension");
  read_beats(scene_node, scene, mistakes);
  if (outputs && sound) check_needs(*outputs, scene, mistakes);
}

}  // namespace cohort
