#pragma once

#include <string>
#include <vector>

namespace cohort {

/// Names of the laws and tensions there are. A stand-in until the kernels are there.
inline std::vector<std::string> laws() {
  return {"guccione", "neo_hookean"};
}
inline std::vector<std::string> tensions() {
  return {"constant", "twitch"};
}

}  // namespace cohort
