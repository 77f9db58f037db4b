#pragma once

#include <string>

#include "solver/device.hpp"

namespace cohort {

/// A rank among those of its host.
struct LocalRank {
  int index = 0, count = 1;
};

/// Divides the host's cores among its ranks for PoCL, unless the user has: sets POCL_MAX_PTHREAD_COUNT. Call
/// before the first OpenCL call of the process; PoCL reads it once.
void share_cores(LocalRank local);

/// The device of a rank. `wish` is empty (GPUs if there are any, one for each local rank, in turns where
/// there are more ranks; else the CPU, shared), "gpu", "cpu", or an index into devices(), which every rank
/// then takes. Throws std::runtime_error "no OpenCL device: ..." with what to install, or with what there is.
DeviceInfo choose_device(const std::string& wish, LocalRank local);

}  // namespace cohort
