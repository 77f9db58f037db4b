#include "ensemble/config.hpp"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "ensemble/accuracy.hpp"
#include "ensemble/config_sections.hpp"
#include "ensemble/identity.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/sha256.hpp"

namespace cohort {

namespace {

std::string joined(const std::vector<std::string>& lines) {
  return fmt::format("{}", fmt::join(lines, "\n"));
}

bool sets_store(const std::string& assignment) {
  return assignment.starts_with("store=");
}

/// The file with a comment line for each --set, the store's path aside.
std::string with_overrides(const std::string& text, const std::vector<std::string>& overrides) {
  std::string result = text;
  if (!result.empty() && result.back() != '\n') result += '\n';
  for (const std::string& assignment : overrides)
    if (!sets_store(assignment)) result += "# --set " + assignment + "\n";
  return result;
}

/// What a --set sets and something samples would be ignored for every member: a mistake.
void refuse_set_of_sampled(Node* scene, Node* outputs, const Campaign& campaign, Mistakes& mistakes) {
  for (const SampledParameter& sampled : campaign.parameters)
    refuse_set(scene, outputs, sampled.path,
               fmt::format("is sampled under parameters; set its distribution, parameters.{}={{..}}, instead",
                           sampled.path),
               mistakes);
  for (const std::string& path : campaign.points_paths)
    refuse_set(scene, outputs, path, "is a column of the points; change it in " + campaign.points_file,
               mistakes);
}

/// The value below `node` that `path` leads to, or null.
Node* find_level(Node& node, const std::string& path) {
  Node* level = &node;
  std::istringstream keys(path);
  for (std::string key; level && std::getline(keys, key, '.');) level = level->find(key);
  return level;
}

/// Declares the parameters that the structure holds; what a `sound` structure lacks is a mistake of the
/// file, of what it names or else of the scene at `place`; what one with mistakes lacks follows from those.
bool declare(Scene& scene, bool sound, const Places& places, const Place& place, Mistakes& mistakes) {
  try {
    declare_parameters(scene);
    return true;
  } catch (const std::invalid_argument& error) {
    if (sound)
      mistakes.add(place_named(places, scene.parameters, error.what()).value_or(place), error.what());
    return false;
  }
}

/// Where the geometry has mistakes: marks as read what depends on it, so that nothing is told that follows
/// from them, and returns these levels. With a simple geometry in its place all other numbers can be checked.
std::vector<std::string> put_geometry_aside(Node& node, Scene& scene) {
  Scene other = scene;
  other.geometry = scene.geometry == GeometryKind::shapes ? GeometryKind::box : GeometryKind::heart;
  other.labels.reset();
  other.shapes.clear();
  other.regions.clear();
  other.region_cell_models.clear();
  other.heterogeneity = {};
  other.mechanics.reset();
  other.parameters = {};
  scene = std::move(other);
  std::vector<std::string> levels = {"geometry", "electrophysiology.regions",
                                     "electrophysiology.heterogeneity", "mechanics", "circulation"};
  for (const std::string& model : cell_models())
    if (model != scene.cell_model) levels.push_back("electrophysiology." + model);
  for (const std::string& level : levels)
    if (Node* aside = find_level(node, level)) aside->read = true;
  return levels;
}

/// Checks a section that no output needs: it stays in the file while outputs are switched on and off. scene:
/// with an output that needs it.
void check_unused(Node& section, Scene scene, Mistakes& mistakes) {
  if (declare(scene, false, {}, section.place, mistakes))
    read_parameters(section, scene.parameters, mistakes);
  section.read = true;
}

/// Leaves out the mechanics, the circulation and the beats that no output needs.
void leave_out_loads(Node& node, Scene& scene, Mistakes& mistakes) {
  if (scene.pv || scene.displacement || scene.stretch_activated) return;  // stretch acts on every output
  Scene with = scene;
  with.pv.emplace();
  for (const char* path : {"mechanics", "circulation", "time.beats"})
    if (Node* section = find_level(node, path); section && !section->read)
      check_unused(*section, with, mistakes);
  scene.mechanics.reset();
  scene.circulation.reset();
  scene.beats.reset();
}

/// The structure keys that the reader has looked for at and below `node`.
void gather_known(const Node& node, std::set<std::string>& keys) {
  for (const std::string& key : node.known) keys.insert(node.path.empty() ? key : node.path + "." + key);
  for (const Node::Entry& entry : node.entries) gather_known(entry.value, keys);
}

/// The campaign that the tree holds; complete only where there are no mistakes.
Campaign read_root(Node& root, const std::string& text, const std::string& file,
                   const std::vector<std::string>& overrides, Mistakes& mistakes) {
  Campaign campaign;
  if (root.kind == Node::Kind::null && !mistakes.empty()) return campaign;
  if (root.kind == Node::Kind::null)
    mistakes.add({file, 1, 1}, "the file is empty; a campaign needs scene and outputs");
  else if (root.kind != Node::Kind::map)
    mistakes.add(root.place, "a campaign file is a map of keys (scene, outputs, ...), " + found(root));
  if (root.kind != Node::Kind::map) return campaign;
  for (size_t i = 0; i < overrides.size(); ++i)
    apply_override(root, overrides[i], static_cast<int>(i) + 1, mistakes);

  name_levels(root, "");
  Node* scene = require_map(root, "scene", mistakes);
  Node* outputs = require_map(root, "outputs", mistakes);
  Node* parameters = take_map(root, "parameters", mistakes);
  Node* section = take_map(root, "campaign", mistakes);
  Node* store = take(root, "store");
  if (Node* accuracy = take_map(root, "accuracy", mistakes))
    read_accuracy(*accuracy, file, campaign.accuracy, mistakes);
  check_keys(root, {}, mistakes);
  if (scene) {
    name_levels(*scene, "");
    scene->name = "scene";
  }
  gather_places(root, campaign.places);

  const size_t before = mistakes.size();
  read_structure(scene, outputs, file, campaign.scene, mistakes);
  const bool sound = mistakes.size() == before;
  std::string points;
  if (scene && campaign.scene.geometry != GeometryKind::none)
    leave_out_loads(*scene, campaign.scene, mistakes);
  if (Node* torso = scene ? scene->find("torso") : nullptr; torso && !torso->read && !campaign.scene.ecg) {
    Scene with = campaign.scene;
    with.ecg.emplace();
    check_unused(*torso, with, mistakes);
  }
  const Place& place = scene ? scene->place : root.place;
  std::vector<std::string> aside;
  bool declared = declare(campaign.scene, sound, campaign.places, place, mistakes);
  if (!declared && scene) {
    aside = put_geometry_aside(*scene, campaign.scene);
    declared = declare(campaign.scene, false, campaign.places, place, mistakes);
  }
  if (declared) {
    if (scene) read_parameters(*scene, campaign.scene.parameters, mistakes);
    if (outputs) read_parameters(*outputs, campaign.scene.parameters, mistakes);
    if (parameters) read_sampled(*parameters, aside, campaign, mistakes);
    points = read_campaign_section(section, file, aside.empty(), campaign, mistakes);
    refuse_set_of_sampled(scene, outputs, campaign, mistakes);
  }

  campaign.store = std::filesystem::path(file).stem().string() + ".h5";
  if (store) campaign.store = read_text(*store, "store", mistakes).value_or("");
  if (!mistakes.empty()) return campaign;

  campaign.text = with_overrides(text, overrides) + points;
  campaign.sha256 = sha256(canonical_text(campaign));
  return campaign;
}

}  // namespace

ConfigError::ConfigError(std::vector<std::string> mistakes)
    : std::runtime_error(joined(mistakes)), mistakes_(std::move(mistakes)) {}

std::string read_campaign_file(const std::string& file) {
  if (std::filesystem::is_directory(file))
    throw ConfigError({file + ": is a directory, not a campaign file"});
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw ConfigError({fmt::format("{}: cannot be read: {}", file, std::strerror(errno))});
  return {std::istreambuf_iterator<char>(stream), {}};
}

Campaign read_campaign(const std::string& file, const std::vector<std::string>& overrides) {
  return parse_campaign(read_campaign_file(file), file, overrides);
}

namespace {

Campaign parse_as_it_stands(const std::string& text, const std::string& file,
                            const std::vector<std::string>& overrides) {
  Mistakes mistakes;
  Node root = parse_document(text, file, mistakes);
  if (root.kind == Node::Kind::map && root.find("kind") && root.find("base"))
    throw ConfigError({fmt::format("{}: this is a study, not a campaign: cohort study {}", file, file)});
  Campaign campaign = read_root(root, text, file, overrides, mistakes);
  if (!mistakes.empty()) throw ConfigError(mistakes.lines());
  return campaign;
}

}  // namespace

namespace {

/// What stands behind the command line's own --set was chosen: its places are those of the measurements.
std::vector<std::string> in_measurements(const std::vector<std::string>& lines, std::size_t of_command_line,
                                         const std::vector<Place>& places) {
  std::vector<std::string> result = lines;
  for (std::string& line : result)
    for (std::size_t i = 0; i < places.size(); ++i)
      if (const std::string front = fmt::format("--set:{}:", of_command_line + i + 1);
          line.starts_with(front))
        line = fmt::format("{}:{}:{}:{}", places[i].file, places[i].line, places[i].column,
                           line.substr(front.size()));
  return result;
}

/// Whether one of two paths is that of the other or of a level above it.
bool overlap(const std::string& a, const std::string& b) {
  return (a + ".").starts_with(b + ".") || (b + ".").starts_with(a + ".");
}

}  // namespace

Campaign parse_campaign(const std::string& text, const std::string& file,
                        const std::vector<std::string>& overrides) {
  Campaign campaign = parse_as_it_stands(text, file, overrides);
  if (campaign.accuracy.wishes.empty()) return campaign;
  AccuracyChoice choice = choose_setting(campaign);
  // What the command line sets stays, and would make the choice's bounds untrue.
  for (const std::string& chosen : choice.overrides)
    for (std::size_t i = 0; i < overrides.size(); ++i) {
      const std::string path = chosen.substr(0, chosen.find('='));
      std::string own = overrides[i].substr(0, overrides[i].find('='));
      if (!own.starts_with("scene")) own.insert(0, "scene.");
      if (overlap(own, "scene." + path))
        throw ConfigError({fmt::format("--set:{}: {} is chosen by accuracy ({}); leave one of them out",
                                       i + 1, path, chosen)});
    }
  std::vector<std::string> all = overrides;
  all.insert(all.end(), choice.overrides.begin(), choice.overrides.end());
  try {
    campaign = parse_as_it_stands(text, file, all);
  } catch (const ConfigError& error) {
    throw ConfigError(in_measurements(error.mistakes(), overrides.size(), choice.places));
  }
  for (auto& [path, place] : campaign.places)
    if (const auto first = static_cast<int>(overrides.size()); place.file == "--set" && place.line > first)
      place = choice.places[static_cast<std::size_t>(place.line - first - 1)];
  for (const std::string& line : choice.lines) campaign.text += "# " + line + "\n";
  campaign.accuracy_lines = std::move(choice.lines);
  campaign.accuracy_warnings = std::move(choice.warnings);
  return campaign;
}

std::set<std::string> keys_looked_for(const std::string& text, const std::string& file) {
  Mistakes mistakes;
  Node root = parse_document(text, file, mistakes);
  read_root(root, text, file, {}, mistakes);
  std::set<std::string> keys;
  gather_known(root, keys);
  return keys;
}

}  // namespace cohort
