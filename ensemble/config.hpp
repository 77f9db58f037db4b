#pragma once

#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "ensemble/campaign.hpp"

namespace cohort {

/// What is wrong with a campaign file: every mistake as "file:line:column: message", in the order of the
/// file.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<std::string> mistakes);
  const std::vector<std::string>& mistakes() const { return mistakes_; }

 private:
  std::vector<std::string> mistakes_;
};

/// Reads and checks a campaign file. Each of `overrides` is the "key=value" of a --set: a path as in the file
/// without the leading "scene.", and a YAML value that replaces or adds what stands there.
///
/// Campaign::text is the file followed by a line "# --set key=value" for each override and, for a CSV of
/// points, a line with its checksum; where the rows are stored does not enter it. Campaign::sha256 names the
/// campaign by what determines its results (canonical_text), not by this text: two runs with one sha256
/// compute the same rows. A store is resumed under another name, timeout, number of retries or members in a
/// launch, and from a file whose comments have changed.
///
/// Throws ConfigError with all mistakes; nothing else is thrown for bad input.
Campaign read_campaign(const std::string& file, const std::vector<std::string>& overrides = {});

/// As read_campaign, of a text already in memory; `file` names it in messages and is what relative paths
/// relate to.
Campaign parse_campaign(const std::string& text, const std::string& file,
                        const std::vector<std::string>& overrides = {});

/// Paths of the keys that are structure (everything but parameters) and that the reader looks for on the
/// levels that stand in `text`, sound or not.
std::set<std::string> keys_looked_for(const std::string& text, const std::string& file);

/// Contents of a campaign file. Throws ConfigError if it cannot be read.
std::string read_campaign_file(const std::string& file);

}  // namespace cohort
