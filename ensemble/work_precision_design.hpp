#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/study.hpp"

namespace cohort {

/// True for the paths of spacings and steps: what an error falls with.
bool is_step(const std::string& path);

/// What a setting comes to in its scene, whoever has set it: settings are compared by this.
struct ResolvedSetting {
  std::string rest;  ///< all but precision and numbers: canonical_text
  Precision precision = Precision::single_;
  std::map<std::string, double> values;  ///< by path, what is inherited resolved; the mechanics' own spacing
};
ResolvedSetting resolved(const Campaign& campaign);

/// One way to run the scene: what it sets in the campaign file, by path, and its short name.
struct Setting {
  std::string label;
  std::vector<std::pair<std::string, std::string>> values;  ///< path and value as YAML, in order
  bool is_default = false;                                  ///< the same campaign as the base's own
  std::vector<Place> places = {};                           ///< of the values

  std::vector<std::string> overrides() const;  ///< "path=value"
};

/// The section of a study of kind work_precision.
struct WorkPrecisionDesign {
  std::vector<Setting> scenes;          ///< of for_each: each has its own reference and front; one at least
  std::vector<Setting> settings;        ///< (R), the default among them
  std::optional<Setting> reference;     ///< the run that is taken for the truth, or
  std::map<std::string, double> known;  ///< exact or published values of features
  std::vector<std::string> measures;    ///< (M) whole names of features, or norms: ecg, pressure, volume, ...
  int repeats = 3;
  std::string measurements;  ///< file to be written for `accuracy:`, or empty
};

/// The study with what `scene` sets behind its own overrides.
Study in_scene(const Study& study, const Setting& scene);

/// Parses every setting and the reference as a campaign, in every scene: they have the base's members, differ
/// from each other, and give every measure. Marks the default, or adds it; measures and known values get the
/// whole names of their features. Files that would be written over, or into no folder, are refused. Adds to
/// `mistakes`; throws ConfigError for mistakes in campaigns.
void check_design(Study& study, WorkPrecisionDesign& design, Mistakes& mistakes);

/// Reads what `study.root` holds beside its head, and checks it. Throws ConfigError with all mistakes.
WorkPrecisionDesign read_work_precision(Study& study);

}  // namespace cohort
