#include "ensemble/guarded.hpp"

#include <spdlog/fmt/fmt.h>

#include <cstdio>

#include "ensemble/config.hpp"
#include "ensemble/ranks.hpp"

namespace cohort {

ExitCode guarded(ExitCode on_error, const std::function<ExitCode()>& stage) {
  try {
    return stage();
  } catch (const ConfigError& error) {
    for (const std::string& mistake : error.mistakes()) fmt::print(stderr, "{}\n", mistake);
  } catch (const ToldByAnotherRank&) {
  } catch (const std::exception& error) {
    fmt::print(stderr, "cohort: {}\n", error.what());
  }
  return on_error;
}

}  // namespace cohort
