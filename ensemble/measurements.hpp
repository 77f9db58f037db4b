#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/campaign.hpp"

namespace cohort {

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
};

/// What a study has measured of a scene's settings: the small file that `accuracy:` chooses from, YAML.
struct Measurements {
  static constexpr int version = 1;
  std::string file;                               ///< its name, for messages
  std::string program, study, device, reference;  ///< who, what, where, against which run
  int members = 0;                                ///< measured with each setting
  std::vector<std::string> structure;             ///< lines that hold for every setting (scene_structure)
  std::vector<std::string> varied;                ///< lines that hold for some of them
  std::map<std::string, double> values;           ///< by path: what the scene sets beside the defaults
  std::map<std::string, std::pair<double, double>> sampled;  ///< by path: range over the members
  std::map<std::string, std::string> features;               ///< by name: unit
  std::vector<MeasuredSetting> settings;                     ///< fastest first
};

/// The structure of a scene without its outputs, a line for each fact, sorted.
std::vector<std::string> scene_structure(const Scene& scene);

/// By path, the numbers that a scene sets beside what its structure has as defaults.
std::map<std::string, double> own_values(const Scene& scene);

/// What k of mean + k deviation bounds a share of 95 % of a normal distribution with a confidence of 90 %,
/// from n >= 2 samples (M. G. Natrella, Experimental Statistics, NBS Handbook 91, 1963, 2-5: approximation).
double tolerance_factor(int n);

std::string measurements_text(const Measurements& measurements);
/// Throws ConfigError with every mistake of the file.
Measurements read_measurements(const std::string& text, const std::string& file);

/// Of those that are built in, configs/measurements: name and text.
const std::map<std::string, std::string>& built_in_measurements();

}  // namespace cohort
