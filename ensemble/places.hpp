#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "ensemble/document.hpp"

namespace cohort {

struct Campaign;
class ParameterTable;

/// Where the paths of a campaign file stand: a number or a word at its value, anything else at its key. What
/// `parameters` samples stands there unless the scene sets it too.
using Places = std::map<std::string, Place>;

/// Adds every path below `node`, which name_levels has named.
void gather_places(const Node& node, Places& places);

/// Place of the first path that `message` names and the file holds; of what the file leaves at
/// its default, that of the level it would stand in. Nothing where no path is named.
std::optional<Place> place_named(const Places& places, const ParameterTable& parameters,
                                 const std::string& message);

/// Runs `stage`. An exception whose message names a path of the campaign's file becomes a ConfigError with
/// "file:line:column: " before it; all others pass.
void told_in_place(const Campaign& campaign, const std::function<void()>& stage);

}  // namespace cohort
