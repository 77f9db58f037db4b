#pragma once

#include <string>

#include "ensemble/study.hpp"

namespace cohort {

/// Throws ConfigError where a study of error against run time could not write its files, or would write them
/// over what is none of its own: looked at before anything runs. `measurements`: empty where none are
/// written.
void check_work_precision_files(const Study& study, const std::string& measurements);

/// The same of the table of a study of stability, whose stores are looked at as those of campaigns.
void check_stability_files(const Study& study);

}  // namespace cohort
