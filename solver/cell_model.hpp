#pragma once

#include <string>
#include <vector>

#include "solver/parameters.hpp"

namespace cohort {

/// What a file of kernels/cells declares of itself in its lines `//@`:
///   //@ parameter NAME DEFAULT LOWER UPPER UNIT "meaning" "source"
///   //@ rest NAME                      the parameter that is the initial potential
///   //@ state NAME INITIAL
///   //@ derived NAME PARAMETER...      a constant computed from these by cell_derive()
struct CellModel {
  struct State {
    std::string name;
    double initial;
  };
  struct Derived {
    std::string name;
    std::vector<int> from;  ///< indices into `parameters`
  };
  std::string name;
  std::vector<Parameter> parameters;  ///< paths are bare names
  std::vector<State> states;
  std::vector<Derived> derived;
  int rest = -1;  ///< index into `parameters`

  /// Macros P_<parameter>, D_<derived>, S_<state> and CELL_PARAMETERS, CELL_DERIVED, CELL_STATES, REST,
  /// INITIAL_STATES for the kernels.
  std::string macros() const;
};

/// Reads kernels/cells/<name>.cl. Throws std::invalid_argument where there is no such model or its
/// declarations are not as above (with the line).
CellModel read_cell_model(const std::string& name);

}  // namespace cohort
