#pragma once

#include <string>
#include <vector>

#include "ensemble/campaign.hpp"
#include "ensemble/document.hpp"

namespace cohort {

/// The head of a study file: which study, of which campaign file, with what set in it.
struct Study {
  enum class Kind { work_precision, stability };
  Kind kind = Kind::work_precision;
  std::string file;                    ///< of the study
  std::string base, base_text;         ///< the campaign file and its contents
  std::vector<std::string> overrides;  ///< "key=value": those of `set`, behind them those of the command line
  std::string store;                   ///< path of the HDF5 file
  Node root;                           ///< the whole file; what belongs to the kind has not been read yet
};

/// Reads the keys kind, base, set and store, and leaves the others to the kind, which ends with check_keys.
/// An override of a key of the kind's own section (stability.corners=8) is applied here, all others to the
/// base. Adds to `mistakes`; complete only where there are none.
Study read_study(const std::string& file, const std::vector<std::string>& overrides, Mistakes& mistakes);

/// "key=value" of every entry of a map of settings, in its order, values as YAML in one line.
std::vector<std::string> settings(const Node& map);

/// A node as YAML in one line.
std::string flow_text(const Node& node);

/// Refuses a store whose place the table or the picture beside it would take, or that would take the place of
/// the study's file or its base. Throws ConfigError.
void check_store(const Study& study);
bool same_file(const std::string& a, const std::string& b);

/// Throws std::runtime_error where the file cannot be written, whole or not at all: what stood there stays.
void write_file(const std::string& file, const std::string& bytes);

/// A text as a cell of a CSV file.
std::string csv_cell(std::string text);

/// The campaign of the study's base with `more` set behind its own overrides. Throws ConfigError, each line
/// with `what` in front.
Campaign campaign_of(const Study& study, const std::vector<std::string>& more, const std::string& what);

}  // namespace cohort
