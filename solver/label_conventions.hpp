#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cohort {

/// What each value of a label map means: "background", a blood pool ("lv_blood", "rv_blood", "la_blood",
/// "ra_blood", "aorta_blood", "pulmonary_artery_blood"), or the name of a region of tissue.
using LabelTable = std::map<std::int32_t, std::string>;

/// Names of the conventions of public whole-heart segmentations, and `cohort`, that of our own exports.
std::vector<std::string> label_conventions();

/// Throws std::invalid_argument for a name that is none of them.
LabelTable label_table(const std::string& convention);

/// Blood pools in the order of their codes in LabelCells (1, 2, ...).
inline constexpr const char* blood_names[] = {"lv_blood", "rv_blood",    "la_blood",
                                              "ra_blood", "aorta_blood", "pulmonary_artery_blood"};
/// Regions of the heart in the order of their codes in convention `cohort` (1, 2, ...).
inline constexpr const char* heart_regions[] = {
    "lv", "rv", "la", "ra", "conduction_path", "bachmann", "insulator", "aorta", "pulmonary_artery"};
/// In convention `cohort`: the code of the first blood pool, and of the first region that is not of the
/// heart.
inline constexpr std::int32_t first_blood_label = 11, first_other_label = 101;

}  // namespace cohort
