#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/campaign.hpp"

namespace cohort {

/// Of fewer members nothing is known of how their errors spread.
inline constexpr int least_measured = 4;

/// Errors of one feature with one setting, over the members that were measured; in the feature's unit, and in
/// % of the feature's value.
struct MeasuredError {
  double rms, largest;
  double bound, bound_percent;  ///< for 95 % of such members, with a confidence of 90 %; infinite: not known
};

struct MeasuredSetting {
  std::string label;
  std::vector<std::pair<std::string, std::string>> set;  ///< path and value as YAML
  double device_s;                                       ///< of one member, median
  std::map<std::string, MeasuredError> errors;           ///< by feature
  std::vector<Place> places = {};                        ///< of each of `set` in its file
};

/// What a study has measured of a scene's settings: the small file that `accuracy:` chooses from, YAML.
struct Measurements {
  static constexpr int version = 2;               ///< 1: bounds of one side of |error|
  std::string file;                               ///< its name, for messages
  std::string program, study, device, reference;  ///< who, what, where, against which run
  int members = 0;                                ///< measured with each setting
  std::vector<std::string> structure;             ///< lines that hold for every setting (scene_structure)
  std::vector<std::string> varied;                ///< lines that hold for some of them
  std::vector<std::string> counted;      ///< spacings, steps and tolerances whose errors are in the bounds
  std::map<std::string, double> values;  ///< by path: what the scene sets beside the defaults
  std::map<std::string, std::pair<double, double>> sampled;  ///< by path: range over the members
  std::map<std::string, std::string> features;               ///< by name: unit
  std::vector<MeasuredSetting> settings;                     ///< fastest first
};

/// The structure of a scene without its outputs, a line for each fact, sorted.
std::vector<std::string> scene_structure(const Scene& scene);

/// The parameters of a scene's structure, all as by default.
ParameterTable default_parameters(const Scene& scene);
/// By path, the numbers that a scene sets beside what its structure has as defaults.
std::map<std::string, double> own_values(const Scene& scene);

/// By path, the range that is sampled: of a normal distribution from its 1 % to its 99 % quantile, of others
/// from end to end. Throws as sample() where points are given.
std::map<std::string, std::pair<double, double>> sampled_ranges(const Campaign& campaign);

/// Whether `path` says how a scene is solved and not what it is: settings of these alone can be chosen.
bool is_numerical(const std::string& path);
/// What a scene has there, as YAML; nothing where it has no such number.
std::optional<std::string> numerical_value(const Scene& scene, const std::string& path);
/// All of these paths, for messages.
std::string numerical_paths();

std::string measurements_text(const Measurements& measurements);
/// Throws ConfigError with every mistake of the file.
Measurements read_measurements(const std::string& text, const std::string& file);

/// Of those that are built in, configs/measurements: name and text.
const std::map<std::string, std::string>& built_in_measurements();

}  // namespace cohort
