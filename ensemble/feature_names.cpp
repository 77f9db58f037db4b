#include "ensemble/feature_names.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "ensemble/suggest.hpp"

namespace cohort {

namespace {

std::string short_name(const std::string& name) {
  std::string result = name;
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (result.starts_with("ecg_")) result.erase(0, 4);
  for (const std::string unit :
       {"_mmhg_per_s", "_l_per_min", "_percent", "_mmhg", "_deg", "_ms", "_ml", "_mj", "_mv"})
    if (result.ends_with(unit)) {
      result.erase(result.size() - unit.size());
      break;
    }
  return result;
}

}  // namespace

std::optional<std::size_t> find_feature(const std::vector<std::string>& names, const std::string& wish) {
  if (const auto exact = std::find(names.begin(), names.end(), wish); exact != names.end())
    return static_cast<std::size_t>(exact - names.begin());
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (short_name(names[i]) != short_name(wish)) continue;
    if (found) return {};
    found = i;
  }
  return found;
}

std::string no_such_feature(const std::vector<std::string>& names, const std::string& wish) {
  std::vector<std::string> several;
  for (const std::string& name : names)
    if (short_name(name) == short_name(wish)) several.push_back(name);
  if (several.size() > 1) return fmt::format("{}: ambiguous; may be {}", wish, fmt::join(several, " or "));
  return fmt::format("{}: no such feature here{}", wish, suggestion(wish, names));
}

}  // namespace cohort
