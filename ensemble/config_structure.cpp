#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>

#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/suggest.hpp"

// The keys of `scene` and `outputs` that are structure: what all members share, compiled into the kernels.
namespace cohort {

namespace {

struct ShapeWord {
  const char* word;
  Shape::Kind kind;
  size_t least_operands, most_operands;  ///< 0: a primitive
};

constexpr size_t any_number = 64;
constexpr size_t most_stimuli = 8;  // bits of a cell's mask, kernels/stimulus.clh
constexpr ShapeWord shape_words[] = {
    {"box", Shape::Kind::box, 0, 0},
    {"ellipsoid", Shape::Kind::ellipsoid, 0, 0},
    {"cylinder", Shape::Kind::cylinder, 0, 0},
    {"cone", Shape::Kind::cone, 0, 0},
    {"capsule", Shape::Kind::capsule, 0, 0},
    {"half_space", Shape::Kind::half_space, 0, 0},
    {"union", Shape::Kind::union_, 2, any_number},
    {"intersection", Shape::Kind::intersection, 2, any_number},
    {"subtract", Shape::Kind::subtract, 2, any_number},
    {"smooth_union", Shape::Kind::smooth_union, 2, any_number},
    {"shell", Shape::Kind::shell, 1, 1},
};

std::vector<std::string> names_of(const std::vector<Shape>& shapes) {
  std::vector<std::string> names;
  for (const Shape& shape : shapes) names.push_back(shape.name);
  return names;
}

/// Reads what an operation works on: {subtract: [a, b]}, or {smooth_union: {of: [a, b], smoothing_mm: 4}}
/// where it has a size of its own.
std::optional<std::vector<std::string>> read_operands(Node::Entry& operation, const ShapeWord& word,
                                                      const std::vector<Shape>& before, Mistakes& mistakes) {
  Node* node = &operation.value;
  if (node->kind == Node::Kind::map) {
    node = take(operation.value, "of");
    if (!node) {
      mistakes.add(operation.place,
                   fmt::format("\"of\" is missing in {}: the shapes it works on", operation.value.path));
      return {};
    }
  }
  const auto operands = read_texts(*node, node->path, mistakes);
  if (!operands) return {};
  const bool single = word.most_operands == 1;
  if (operands->size() < word.least_operands || operands->size() > word.most_operands)
    mistakes.add(operation.place, fmt::format("{} needs {}, found {}", word.word,
                                              single ? "one shape" : "two or more shapes", operands->size()));
  const std::vector<std::string> names = names_of(before);
  for (const std::string& operand : *operands)
    if (std::find(names.begin(), names.end(), operand) == names.end())
      mistakes.add(node->place, fmt::format("{} needs the shape \"{}\", which is not defined above it{}",
                                            operation.value.path, operand, suggestion(operand, names)));
  return operands;
}

void read_shape(Node::Entry& entry, Scene& scene, Mistakes& mistakes) {
  Node& node = entry.value;
  if (!check_name(entry, "a shape", mistakes) || !expect_map(node, node.path, mistakes)) {
    node.read = true;
    return;
  }
  // A shape with a mistake keeps its name, so that what refers to it is no further mistake.
  Shape& shape = scene.shapes.emplace_back(Shape{entry.key, Shape::Kind::box, {}});
  std::vector<std::string> words;
  for (const ShapeWord& word : shape_words) words.emplace_back(word.word);
  Node::Entry* chosen = exactly_one(node, words, mistakes);
  if (!chosen) {
    node.read = true;
    return;
  }
  const ShapeWord& word =
      *std::find_if(std::begin(shape_words), std::end(shape_words),
                    [&](const ShapeWord& candidate) { return chosen->key == candidate.word; });
  shape.kind = word.kind;
  if (word.most_operands == 0) return;
  const std::vector<Shape> before(scene.shapes.begin(), scene.shapes.end() - 1);
  const auto operands = read_operands(*chosen, word, before, mistakes);
  if (operands)
    shape.operands = *operands;
  else
    node.read = true;
}

void read_region(Node::Entry& entry, Scene& scene, Mistakes& mistakes) {
  Node& node = entry.value;
  if (!check_name(entry, "a region", mistakes) || !expect_map(node, node.path, mistakes)) {
    node.read = true;
    return;
  }
  Region region;
  region.name = entry.key;
  if (Node* shape = take(node, "shape")) {
    const std::vector<std::string> names = names_of(scene.shapes);
    if (const auto index = read_choice(*shape, shape->path, names, mistakes)) region.shape = names[*index];
  } else {
    mistakes.add(entry.place, fmt::format("\"shape\" is missing in {}", node.path));
  }
  if (Node* excitable = take(node, "excitable"))
    region.excitable = read_bool(*excitable, excitable->path, mistakes).value_or(true);
  if (Node* bath = take(node, "bath")) {
    region.bath = read_bool(*bath, bath->path, mistakes).value_or(false);
    if (region.bath && region.excitable && node.find("excitable"))
      mistakes.add(bath->place, fmt::format("{} is excitable, and no bath", node.path));
    if (region.bath) region.excitable = false;
  }
  if (Node* fibres = take(node, "fibres"))
    region.fibres = read_word<Region::Fibres>(*fibres,
                                              {{"none", Region::Fibres::none},
                                               {"constant", Region::Fibres::constant},
                                               {"transmural", Region::Fibres::transmural}},
                                              region.fibres, mistakes);
  scene.regions.push_back(std::move(region));
}

void read_shapes(Node& geometry, Scene& scene, Mistakes& mistakes) {
  Node* shapes = take_map(geometry, "shapes", mistakes);
  if (shapes) {
    if (shapes->entries.empty())
      mistakes.add(shapes->place, "geometry.shapes is empty; name at least one shape");
    for (Node::Entry& entry : shapes->entries) {
      shapes->known.insert(entry.key);
      read_shape(entry, scene, mistakes);
    }
  }
  if (Node* regions = require_map(geometry, "regions", mistakes)) {
    if (regions->entries.empty())
      mistakes.add(regions->place, "geometry.regions is empty; name at least one region");
    for (Node::Entry& entry : regions->entries) {
      regions->known.insert(entry.key);
      read_region(entry, scene, mistakes);
    }
  }
}

void read_geometry(Node& geometry, const std::string& file, Scene& scene, Mistakes& mistakes) {
  const std::vector<std::string> kinds = {"heart", "box", "shapes", "labels"};
  const Node::Entry* kind = exactly_one(geometry, kinds, mistakes);
  if (!kind) {
    geometry.read = true;
    return;
  }
  if (kind->key == "heart") scene.geometry = GeometryKind::heart;
  if (kind->key == "box") scene.geometry = GeometryKind::box;
  if (kind->key == "shapes") {
    scene.geometry = GeometryKind::shapes;
    read_shapes(geometry, scene, mistakes);
  }
  if (kind->key == "labels") {
    scene.geometry = GeometryKind::labels;
    read_labels(geometry, file, scene, mistakes);
    if (!scene.labels) geometry.read = true;  // its numbers depend on what is wrong
  }
}

/// Whether a circulation stands alone: `geometry: none`, or no geometry beside a circulation.
bool is_without_tissue(Node& scene) {
  Node* geometry = scene.find("geometry");
  if (!geometry) return scene.find("circulation");
  if (geometry->kind != Node::Kind::scalar || geometry->text != "none") return false;
  scene.known.insert("geometry");
  geometry->read = true;
  return true;
}

void read_stimuli(Node& stimuli, Scene& scene, Mistakes& mistakes) {
  for (Node::Entry& entry : stimuli.entries) {
    Node& node = entry.value;
    stimuli.known.insert(entry.key);
    if (!check_name(entry, "a stimulus", mistakes) || !expect_map(node, node.path, mistakes)) {
      node.read = true;
      continue;
    }
    Node::Entry* place = exactly_one(node, {"shape", "site"}, mistakes);
    if (!place) {
      node.read = true;
      continue;
    }
    Stimulus stimulus{entry.key, Stimulus::Kind::site, {}};
    if (place->key == "shape") {
      const auto shape = read_choice(place->value, place->value.path, {"box", "sphere"}, mistakes);
      stimulus.kind = shape == 1u ? Stimulus::Kind::sphere : Stimulus::Kind::box;
      node.read = !shape;
    } else if (const std::vector<std::string> sites = stimulus_sites(scene.geometry); sites.empty()) {
      node.read = true;
      mistakes.add(place->place, fmt::format("{}: this geometry has no named sites; use \"shape: box\" or "
                                             "\"shape: sphere\"",
                                             node.path));
    } else if (const auto index = read_choice(place->value, place->value.path, sites, mistakes)) {
      stimulus.site = sites[*index];
    } else {
      node.read = true;
    }
    if (node.read) continue;  // its numbers depend on what is wrong
    scene.stimuli.push_back(std::move(stimulus));
    if (scene.stimuli.size() == most_stimuli + 1)
      mistakes.add(entry.place, fmt::format("there are more than {} stimuli", most_stimuli));
  }
}

}  // namespace

void read_structure(Node* scene_node, Node* outputs_node, const std::string& file, Scene& scene,
                    Mistakes& mistakes) {
  const bool tissue = scene_node && !is_without_tissue(*scene_node);
  if (scene_node && !tissue) scene.geometry = GeometryKind::none;
  if (scene_node) {
    if (Node* geometry = tissue ? require_map(*scene_node, "geometry", mistakes) : nullptr)
      read_geometry(*geometry, file, scene, mistakes);
    if (Node* precision = take(*scene_node, "precision"))
      scene.precision =
          read_word<Precision>(*precision, {{"single", Precision::single_}, {"double", Precision::double_}},
                               scene.precision, mistakes);
  }
  if (tissue) {
    if (Node* electrophysiology = take_map(*scene_node, "electrophysiology", mistakes))
      read_electrophysiology(*electrophysiology, scene, mistakes);
    if (Node* stimuli = take_map(*scene_node, "stimuli", mistakes)) read_stimuli(*stimuli, scene, mistakes);
    if (Node* torso = take_map(*scene_node, "torso", mistakes)) {
      if (Node* shape = take(*torso, "shape"))
        scene.torso = read_word<TorsoKind>(*shape,
                                           {{"box", TorsoKind::box},
                                            {"ellipsoid", TorsoKind::ellipsoid},
                                            {"cylinder", TorsoKind::cylinder},
                                            {"unbounded", TorsoKind::unbounded}},
                                           scene.torso, mistakes);
    }
  }
  if (outputs_node) read_outputs(*outputs_node, scene, mistakes);
  if (scene_node) read_loads(*scene_node, outputs_node, scene, mistakes);
}

}  // namespace cohort
