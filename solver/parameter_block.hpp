#pragma once

#include <string>

#include "solver/parameters.hpp"

namespace cohort {

/// One line `#define PARAM_<path, dots as underscores> <index>` for each parameter: the place of its value in
/// the block of a member, `global const real *P`. Characters that no identifier may hold become underscores
/// as well. Throws std::invalid_argument naming two paths that give the same macro.
std::string parameter_macros(const ParameterTable& table);

}  // namespace cohort
