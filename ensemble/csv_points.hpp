#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "ensemble/campaign.hpp"

namespace cohort {

/// Points given by a file: a header of parameter paths, then a row of physical values for each member,
/// separated by commas. Blank lines and lines that start with # are skipped.
struct CsvPoints {
  std::vector<std::string> paths;  ///< (P)
  std::vector<double> values;      ///< (rows, P), row-major
  std::size_t rows = 0;
};

/// Reads and checks a file of points against the parameters of a scene: every path exists, may be sampled and
/// occurs once; every value is a number in its range. Throws std::invalid_argument with one line "file:line:
/// mistake" for each mistake (the first 20), and where there are more rows than `most_rows`.
CsvPoints read_csv_points(const std::filesystem::path& file, const ParameterTable& parameters,
                          std::size_t most_rows = most_members);

}  // namespace cohort
