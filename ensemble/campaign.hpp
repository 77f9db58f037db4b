#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ensemble/places.hpp"
#include "solver/scene.hpp"

namespace cohort {

/// Prior of a sampled parameter; maps a point of [0,1] to a value by its inverse cumulative distribution.
struct Distribution {
  enum class Kind { uniform, log_uniform, normal, choice };
  Kind kind = Kind::uniform;
  double a = 0, b = 1;          ///< uniform, log_uniform: bounds; normal: mean, standard deviation
  double lower = 0, upper = 0;  ///< truncation of `normal` (its bounds, else the parameter's admissible
                                ///< range); else the bounds
  std::vector<double> choices;

  /// Value at u in [0, 1].
  double value(double u) const;
};

struct SampledParameter {
  std::string path;
  Distribution distribution;
};

/// Members of one campaign, whose parameters the host holds in memory.
inline constexpr std::int64_t most_members = 10'000'000;

enum class Method { sobol, latin_hypercube, grid, monte_carlo, csv, table };

/// What a study asks with each of its members; they stand in the store beside the rows.
struct StudyMembers {
  std::vector<std::string> groups;   ///< (N) why the member is run: corners, interior, the name of an extreme
  std::vector<std::uint8_t> inside;  ///< (N) 1 where all its values lie within their documented ranges
};

/// The largest error that a feature may have: in `unit`, which is the feature's where it is empty, or "%".
struct AccuracyWish {
  std::string feature;
  double error;
  std::string unit;
};

/// `accuracy:` of a campaign file (accuracy.hpp).
struct Accuracy {
  std::vector<AccuracyWish> wishes;
  std::string measurements;  ///< file; empty: of those that are built in
  std::string where;         ///< place in the campaign file
};

/// A campaign file, read and checked.
struct Campaign {
  Scene scene;
  std::vector<SampledParameter> parameters;
  std::int64_t members = 1;
  Method method = Method::sobol;
  std::uint64_t seed = 0;
  std::string points_file;                ///< Method::csv: header of paths, a row for each member
  std::vector<std::string> points_paths;  ///< Method::csv: the header; Method::table: the columns
  std::string points_sha256;              ///< Method::csv: checksum of the file; Method::table: of the points
  std::vector<double> points;             ///< Method::table: (N, columns)
  StudyMembers study;                     ///< empty but in the campaigns of a study
  double timeout_s = 3600;
  int retries = 0;
  double check_fraction = 0.02;                ///< of the members, run again at half the spacing and the step
  int members_per_device = 0;                  ///< 0: chosen by size
  double memory_limit_GB = 0;                  ///< 0: what the device has
  std::string store;                           ///< path of the HDF5 file
  Accuracy accuracy;                           ///< what was asked for; it is met already
  std::vector<std::string> accuracy_lines;     ///< what was chosen for it, and why
  std::vector<std::string> accuracy_warnings;  ///< what its bounds do not cover
  Places places;                               ///< where what it holds stands in the file
  std::string text;    ///< the file, verbatim, with --set applied as trailing comment lines
  std::string sha256;  ///< of what determines the results (canonical_text), not of `text`
};

}  // namespace cohort
