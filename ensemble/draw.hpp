#pragma once

#include <string>
#include <vector>

namespace cohort {

/// Draws a picture: runs `/usr/bin/python3 -m analysis.<script> arguments...` on this program's source tree.
/// Where that fails, warns with the command that would draw it.
void draw(const std::string& script, const std::vector<std::string>& arguments);

}  // namespace cohort
