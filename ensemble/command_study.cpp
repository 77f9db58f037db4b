#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/stability_study.hpp"
#include "ensemble/work_precision.hpp"

namespace cohort {

ExitCode command_study(const CampaignOptions& options) {
  Mistakes mistakes;
  Study study = read_study(options.file, options.overrides, mistakes);
  if (!mistakes.empty()) throw ConfigError(mistakes.lines());
  if (!options.store.empty()) study.store = options.store;
  check_store(study);
  return study.kind == Study::Kind::stability ? run_stability(study, options)
                                              : run_work_precision(study, options);
}

}  // namespace cohort
