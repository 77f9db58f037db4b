#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cohort {

/// Damerau-Levenshtein distance (optimal string alignment): insertions, deletions, substitutions and swaps of
/// neighbours that turn `a` into `b`.
int edit_distance(std::string_view a, std::string_view b);

/// "; did you mean "dt_ms"?" with the candidate nearest to `word`, else "; known are ..." with all of them
/// when they are few, else nothing.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace cohort
