#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace cohort {

/// One number of a scene. Its path is its name everywhere: in the YAML file, in --set, in the sampler,
/// in the HDF5 file and in `cohort parameters`.
struct Parameter {
  std::string path;            ///< for example "geometry.heart.lv_radius_mm"
  std::string unit;            ///< "mm", "ms", "mS/mm", "1" for none
  double value;                ///< default, or what the file says; NaN where it is `inherits`
  double lower;                ///< smallest admissible value, inclusive
  double upper;                ///< largest admissible value, inclusive
  std::string meaning;         ///< one short sentence
  std::string source;          ///< where the default comes from
  std::string inherits = {};   ///< path of the parameter whose value stands in while this one is NaN
  double inherits_factor = 1;  ///< times this
  bool structural = false;     ///< shared by a whole campaign (grid, time): settable, never sampled
};

/// The parameters of a scene in their fixed order. A member is one value for each of them.
class ParameterTable {
 public:
  /// Appends a parameter. Throws std::logic_error on a path that exists.
  void add(Parameter parameter);
  /// Appends `path`.x, .y and .z, with the same unit, range, meaning and source.
  void add_vector(const Parameter& prototype, double x, double y, double z);

  /// Index of `path`, or -1.
  int find(std::string_view path) const;
  /// Index of `path`. Throws std::out_of_range naming the path.
  int index(std::string_view path) const;

  /// The scene's own value of `path`. Throws std::out_of_range naming the path.
  double value(std::string_view path) const { return (*this)[index(path)].value; }

  const std::vector<Parameter>& all() const { return parameters_; }
  Parameter& operator[](int index) { return parameters_[static_cast<size_t>(index)]; }
  const Parameter& operator[](int index) const { return parameters_[static_cast<size_t>(index)]; }
  int size() const { return static_cast<int>(parameters_.size()); }

  /// The scene's own values, table order; NaN where a parameter inherits and was not set.
  std::vector<double> values() const;
  /// Replaces NaN by the value of the parameter inherited from.
  void resolve(std::vector<double>& values) const;

 private:
  std::vector<Parameter> parameters_;
};

inline constexpr double inherited = std::numeric_limits<double>::quiet_NaN();

}  // namespace cohort
