#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace cohort {

/// Index of the feature that `wish` names among `names`: the whole name, or without its unit and the "ecg_"
/// in front, in any case of letters ("LV_EF" for lv_ef_percent, "QRS" for ecg_QRS_ms). Nothing where none is
/// so called, or several.
std::optional<std::size_t> find_feature(const std::vector<std::string>& names, const std::string& wish);

/// Why find_feature finds nothing: "QT: no such feature here; lv_ef_percent, ..." with those nearest to the
/// wish, or "QT: ambiguous; may be ..." with those that are so called.
std::string no_such_feature(const std::vector<std::string>& names, const std::string& wish);

}  // namespace cohort
