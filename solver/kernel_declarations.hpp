#pragma once

#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "solver/parameters.hpp"

namespace cohort {

/// Names of the files <name>.cl in a folder of kernels/, sorted.
std::vector<std::string> kernels_in(const std::string& folder);

/// Visits the lines `//@ KIND WORD...` of kernels/<folder>/<name>.cl, by which the file declares itself to
/// the host. What `visit` throws as std::invalid_argument is thrown on with the file and the line before it;
/// so is the absence of the file.
void read_declarations(const std::string& folder, const std::string& name,
                       const std::function<void(const std::string& kind, std::istringstream& words)>& visit);

/// The rest of a line  parameter NAME DEFAULT LOWER UPPER UNIT "meaning" "source"; the path is the bare name.
Parameter read_parameter(std::istringstream& words);

}  // namespace cohort
