#pragma once

#include <string>
#include <vector>

#include "solver/parameters.hpp"

namespace cohort {

/// What a file of kernels/cells declares of itself in its lines `//@`:
///   //@ parameter NAME DEFAULT LOWER UPPER UNIT "meaning" "source"
///   //@ rest NAME                      the parameter that is the initial potential
///   //@ state NAME INITIAL [LOWEST HIGHEST]   between which it stays: 0 1 of a gate
///   //@ potential LOWEST HIGHEST [PARAMETER]  between which V stays without a stimulus: mV, or multiples of
///   the
///                                     parameter above rest
///   //@ derived NAME PARAMETER...      a constant computed from these by cell_derive()
struct CellModel {
  struct State {
    std::string name;
    double initial;
    double lowest = -unbounded, highest = unbounded;
  };
  static constexpr double unbounded = 1e30;  ///< still a number in single precision
  struct Derived {
    std::string name;
    std::vector<int> from;  ///< indices into `parameters`
  };
  std::string name;
  std::vector<Parameter> parameters;  ///< paths are bare names
  std::vector<State> states;
  std::vector<Derived> derived;
  int rest = -1;  ///< index into `parameters`
  double lowest_potential = -1000, highest_potential = 1000;
  int potential_unit = -1;  ///< index into `parameters`, or -1: mV

  /// Macros P_<parameter>, D_<derived>, S_<state> and CELL_PARAMETERS, CELL_DERIVED, CELL_STATES, REST,
  /// INITIAL_STATES for the kernels.
  std::string macros() const;
};

/// Reads kernels/cells/<name>.cl. Throws std::invalid_argument where there is no such model or its
/// declarations are not as above (with the line).
CellModel read_cell_model(const std::string& name);

}  // namespace cohort
