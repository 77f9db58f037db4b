#pragma once

#include <functional>

#include "ensemble/commands.hpp"

namespace cohort {

/// Runs `stage` and returns its exit code, or `on_error` where it throws. What is wrong goes to the standard
/// error: a line for each mistake and nothing else, so that editors can jump to them; nothing where another
/// rank tells it.
ExitCode guarded(ExitCode on_error, const std::function<ExitCode()>& stage);

}  // namespace cohort
