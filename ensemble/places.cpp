#include "ensemble/places.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "ensemble/config.hpp"

namespace cohort {

namespace {

bool in_path(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

/// The words of `message` that can be paths: keys joined by dots. A path of files is none.
std::vector<std::string> paths_in(const std::string& message) {
  std::vector<std::string> paths;
  for (auto begin = message.begin(); begin != message.end();) {
    const auto end = std::find_if_not(begin, message.end(), in_path);
    std::string word(begin, end);
    while (word.ends_with('.')) word.pop_back();
    const bool file = (begin != message.begin() && begin[-1] == '/') || (end != message.end() && *end == '/');
    if (!file && word.find('.') != std::string::npos) paths.push_back(std::move(word));
    begin = std::find_if(end, message.end(), in_path);
  }
  return paths;
}

bool is_parameter(const ParameterTable& parameters, const std::string& path) {
  return parameters.find(path) >= 0 || parameters.find(path + ".x") >= 0;
}

}  // namespace

void gather_places(const Node& node, Places& places) {
  constexpr const char* components[] = {".x", ".y", ".z"};
  for (const Node::Entry& entry : node.entries) {
    places.emplace(entry.value.path,
                   entry.value.kind == Node::Kind::scalar ? entry.value.place : entry.place);
    for (size_t axis = 0; axis < std::min(entry.value.items.size(), std::size(components)); ++axis)
      places.emplace(entry.value.path + components[axis], entry.value.items[axis].place);
    gather_places(entry.value, places);
  }
}

std::optional<Place> place_named(const Places& places, const ParameterTable& parameters,
                                 const std::string& message) {
  const std::vector<std::string> paths = paths_in(message);
  for (const std::string& path : paths)
    for (const std::string& way : {path, "parameters." + path})
      if (const auto it = places.find(way); it != places.end()) return it->second;
  // Numbers before names of the structure: they say more.
  for (const bool parameter : {true, false})
    for (std::string path : paths) {
      if (is_parameter(parameters, path) != parameter) continue;
      for (size_t dot = path.rfind('.'); dot != std::string::npos; dot = path.rfind('.')) {
        path.resize(dot);
        if (const auto it = places.find(path); it != places.end()) return it->second;
      }
    }
  return {};
}

void told_in_place(const Campaign& campaign, const std::function<void()>& stage) {
  try {
    stage();
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& error) {
    const auto place = place_named(campaign.places, campaign.scene.parameters, error.what());
    if (!place) throw;
    Mistakes mistakes;
    mistakes.add(*place, error.what());
    throw ConfigError(mistakes.lines());
  }
}

}  // namespace cohort
