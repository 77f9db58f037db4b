#pragma once

#include <string>
#include <vector>

namespace cohort {

/// Runs `python3 -m analysis.MODULE ARGUMENTS` of this program's source tree, with matplotlib. Where that
/// fails it warns, with the command to be tried, and returns false: a picture is no reason to lose results.
bool draw(const std::string& module, const std::vector<std::string>& arguments);

}  // namespace cohort
