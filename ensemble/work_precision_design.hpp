#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/study.hpp"

namespace cohort {

/// One way to run the scene: what it sets in the campaign file, by path, and its short name.
struct Setting {
  std::string label;
  std::vector<std::pair<std::string, std::string>> values;  ///< path and value as YAML, in order
  bool is_default = false;                                  ///< the same campaign as the base's own

  std::vector<std::string> overrides() const;  ///< "path=value"
};

/// The section of a study of kind work_precision.
struct WorkPrecisionDesign {
  std::vector<Setting> scenes;          ///< of for_each: each has its own reference and front; one at least
  std::vector<Setting> settings;        ///< (R), the default among them
  std::optional<Setting> reference;     ///< the run that is taken for the truth, or
  std::map<std::string, double> known;  ///< exact or published values of features
  std::vector<std::string> measures;    ///< (M) features, or norms of series: ecg, pressure, volume, ...
  int repeats = 3;
  std::string measurements;  ///< file to be written for `accuracy:`, or empty
};

/// The study with what `scene` sets behind its own overrides.
Study study_of(const Study& study, const Setting& scene);

/// Reads what `study.root` holds beside its head; every setting is parsed as a campaign. Throws ConfigError
/// with all mistakes.
WorkPrecisionDesign read_work_precision(Study& study);

}  // namespace cohort
