#pragma once

#include <string>
#include <vector>

namespace cohort {

/// The keys of a campaign file that are structure: words, texts, lists and maps, not parameters. NAME stands
/// for a name of the user's, PATH for the path of a parameter.
struct StructureKey {
  const char* path;
  const char* takes;
  const char* unless_given;
  const char* meaning;
};
const std::vector<StructureKey>& structure_keys();

/// `path` with NAME, PATH and PARAMETER where the user has names of his own, and without the component of a
/// vector.
std::string key_pattern(const std::string& path);

/// Whether the page has the key `path`, as it is or as a pattern.
bool is_documented(const std::string& path);

/// Every key of a campaign file with what it takes, default, unit and range: configs/keys.md.
std::string key_reference();

}  // namespace cohort
