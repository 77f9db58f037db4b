#include "ensemble/stability_study.hpp"

#include <stdexcept>

namespace cohort {

ExitCode run_stability(Study&, const CampaignOptions&) {
  throw std::runtime_error("this kind of study is not built yet");
}

}  // namespace cohort
