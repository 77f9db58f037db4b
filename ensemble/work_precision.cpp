#include "ensemble/work_precision.hpp"

#include <stdexcept>

namespace cohort {

ExitCode run_work_precision(Study&, const CampaignOptions&) {
  throw std::runtime_error("this kind of study is not built yet");
}

}  // namespace cohort
