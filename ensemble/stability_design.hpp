#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/campaign.hpp"
#include "ensemble/study.hpp"

namespace cohort {

/// A documented range of a parameter: within it Cohort promises a result.
struct StabilityRange {
  std::string path;
  double low = 0, high = 0;
};

/// Values far out, by a name.
struct StabilityExtreme {
  std::string name;
  std::vector<std::pair<std::string, double>> values;
};

/// What is run of one scene.
struct StabilityCase {
  std::string name;  ///< empty for the scene of the study itself
  Campaign campaign;
  std::vector<StabilityRange> ranges;
  std::vector<StabilityExtreme> extremes;
  std::int64_t corners = 0;      ///< at most; all 2^d where these are fewer
  std::int64_t interior = 0;     ///< points between them
  std::int64_t with_inside = 0;  ///< points inside at which each extreme is tried besides the defaults
  bool inside = true;            ///< false: the scene itself is beyond what is promised
};

/// Members of one case.
struct StabilityDesign {
  std::vector<std::string> paths;    ///< (P) every parameter of a range or an extreme
  std::vector<double> values;        ///< (N, P)
  std::vector<std::string> groups;   ///< (N) "defaults", "corners", "interior" or an extreme's name
  std::vector<std::uint8_t> inside;  ///< (N)
};

/// The defaults; the corners of the ranges, in random pairs of opposites, none twice; a scrambled Sobol' set
/// between them; each extreme at the defaults, then at points inside. A function of the case and the seed.
StabilityDesign stability_design(const StabilityCase& one, std::uint64_t seed);

/// Makes the case's campaign that of the design: its members, seed and points, with a checksum of them.
void use_design(StabilityDesign design, std::uint64_t seed, Campaign& campaign);

struct StabilityStudy {
  std::vector<StabilityCase> cases;
  std::uint64_t seed = 0;
  double inside_done = 0.99;  ///< least share of the members inside that has to be done
};

/// Reads the section `stability` of a study file, the cases' campaigns with it. Throws ConfigError with all
/// mistakes of the study file, or of a campaign that it makes.
StabilityStudy read_stability(Study& study);

}  // namespace cohort
