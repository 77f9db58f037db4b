#include "solver/cell_model.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "solver/kernel_declarations.hpp"
#include "solver/scene.hpp"

namespace cohort {

namespace {

constexpr const char* folder = "cells";

int parameter_index(const CellModel& model, const std::string& name) {
  const auto it = std::find_if(model.parameters.begin(), model.parameters.end(),
                               [&](const Parameter& p) { return p.path == name; });
  return it == model.parameters.end() ? -1 : static_cast<int>(it - model.parameters.begin());
}

void read_declaration(CellModel& model, const std::string& kind, std::istringstream& words) {
  if (kind == "parameter") {
    model.parameters.push_back(read_parameter(words));
  } else if (kind == "state") {
    CellModel::State state;
    words >> state.name >> state.initial;
    if (!words) throw std::invalid_argument("want: state NAME INITIAL [LOWEST HIGHEST]");
    if (double lowest = 0, highest = 0; words >> lowest >> highest) {
      state.lowest = lowest;
      state.highest = highest;
    }
    model.states.push_back(std::move(state));
  } else if (kind == "potential") {
    words >> model.lowest_potential >> model.highest_potential;
    if (!words) throw std::invalid_argument("want: potential LOWEST HIGHEST [PARAMETER]");
    if (std::string name; words >> name) {
      model.potential_unit = parameter_index(model, name);
      if (model.potential_unit < 0) throw std::invalid_argument("potential: no parameter " + name);
    }
  } else if (kind == "rest") {
    std::string name;
    words >> name;
    model.rest = parameter_index(model, name);
    if (model.rest < 0) throw std::invalid_argument("rest: no parameter " + name);
  } else if (kind == "derived") {
    CellModel::Derived derived;
    words >> derived.name;
    for (std::string name; words >> name;) {
      derived.from.push_back(parameter_index(model, name));
      if (derived.from.back() < 0) throw std::invalid_argument("derived: no parameter " + name);
    }
    model.derived.push_back(std::move(derived));
  } else {
    throw std::invalid_argument("unknown declaration " + kind);
  }
}

}  // namespace

CellModel read_cell_model(const std::string& name) {
  const std::vector<std::string> known = cell_models();
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw std::invalid_argument("no cell model \"" + name + "\" in kernels/cells");
  CellModel model;
  model.name = name;
  read_declarations(folder, name, [&](const std::string& kind, std::istringstream& words) {
    read_declaration(model, kind, words);
  });
  if (model.rest < 0 || model.states.empty())
    throw std::invalid_argument("kernels/cells/" + name + ".cl: a cell model needs rest and state lines");
  return model;
}

std::string CellModel::macros() const {
  std::ostringstream text;
  text << std::setprecision(17);
  for (size_t k = 0; k < parameters.size(); ++k)
    text << "#define P_" << parameters[k].path << " " << k << "\n";
  for (size_t k = 0; k < derived.size(); ++k) text << "#define D_" << derived[k].name << " " << k << "\n";
  for (size_t k = 0; k < states.size(); ++k) text << "#define S_" << states[k].name << " " << k << "\n";
  text << "#define CELL_PARAMETERS " << parameters.size() << "\n#define CELL_DERIVED " << derived.size()
       << "\n#define CELL_STATES " << states.size() << "\n#define REST " << rest
       << "\n#define INITIAL_STATES {";
  for (const State& state : states) text << state.initial << ", ";
  text << "}\n";
  return text.str();
}

std::vector<std::string> cell_models() {
  return kernels_in(folder);
}

}  // namespace cohort
