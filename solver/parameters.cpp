#include "solver/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace cohort {

void ParameterTable::add(Parameter parameter) {
  if (find(parameter.path) >= 0) throw std::logic_error("parameter declared twice: " + parameter.path);
  parameters_.push_back(std::move(parameter));
}

void ParameterTable::add_vector(const Parameter& prototype, double x, double y, double z) {
  const double values[] = {x, y, z};
  const char* suffixes[] = {".x", ".y", ".z"};
  for (int axis = 0; axis < 3; ++axis) {
    Parameter component = prototype;
    component.path += suffixes[axis];
    component.value = values[axis];
    add(std::move(component));
  }
}

int ParameterTable::find(std::string_view path) const {
  const auto it = std::find_if(parameters_.begin(), parameters_.end(),
                               [&](const Parameter& p) { return p.path == path; });
  return it == parameters_.end() ? -1 : static_cast<int>(it - parameters_.begin());
}

int ParameterTable::index(std::string_view path) const {
  const int i = find(path);
  if (i < 0) throw std::out_of_range("no parameter " + std::string(path));
  return i;
}

std::vector<double> ParameterTable::values() const {
  std::vector<double> result(parameters_.size());
  std::transform(parameters_.begin(), parameters_.end(), result.begin(),
                 [](const Parameter& p) { return p.value; });
  return result;
}

void ParameterTable::resolve(std::vector<double>& values) const {
  for (size_t i = 0; i < parameters_.size(); ++i) {
    if (std::isnan(values[i]) && !parameters_[i].inherits.empty())
      values[i] =
          parameters_[i].inherits_factor * values[static_cast<size_t>(index(parameters_[i].inherits))];
  }
}

}  // namespace cohort
