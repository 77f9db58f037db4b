#pragma once

#include <string>
#include <vector>

#include "ensemble/campaign.hpp"
#include "ensemble/document.hpp"

namespace cohort {

/// Reads `accuracy: {feature: error, ...}` of a campaign file: "3 ms", "1 %" or a number in the feature's
/// unit; `measurements` names the file to choose from. % is of the feature's value, also where the feature's
/// own unit is %.
void read_accuracy(Node& map, const std::string& file, Accuracy& accuracy, Mistakes& mistakes);

/// What was chosen, and why.
struct AccuracyChoice {
  std::vector<std::string> overrides;  ///< "path=value"
  std::vector<Place> places;           ///< of each of them, in the file of measurements
  std::vector<std::string> lines;      ///< to be told
  std::vector<std::string> warnings;   ///< what the bounds do not cover: values beyond what was measured, or
                                       ///< another program's measurements
};

/// The cheapest measured setting whose bounds meet what campaign.accuracy asks for. Throws ConfigError where
/// nobody has measured such a scene or such a feature, its unit is another, or no setting is good enough
/// (with what they have).
AccuracyChoice choose_setting(const Campaign& campaign);

}  // namespace cohort
