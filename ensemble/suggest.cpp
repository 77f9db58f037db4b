#include "ensemble/suggest.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace cohort {

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = static_cast<int>(i);
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i) {
    for (size_t j = 1; j <= b.size(); ++j) {
      const int substitution = a[i - 1] == b[j - 1] ? 0 : 1;
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + substitution});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr size_t most_listed = 12;
  const std::string* nearest = nullptr;
  // A third of the letters may be wrong; beyond that a suggestion is a guess.
  int best = std::max(2, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& candidate : candidates) {
    const int distance = edit_distance(word, candidate);
    if (distance < best && distance < static_cast<int>(candidate.size())) {
      best = distance;
      nearest = &candidate;
    }
  }
  if (nearest) return fmt::format("; did you mean \"{}\"?", *nearest);
  if (!candidates.empty() && candidates.size() <= most_listed)
    return fmt::format("; known are {}", fmt::join(candidates, ", "));
  return {};
}

}  // namespace cohort
