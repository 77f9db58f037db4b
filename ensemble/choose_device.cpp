#include "ensemble/choose_device.hpp"

#include <sched.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <stdexcept>

namespace cohort {

namespace {

/// Cores that this process may run on: mpirun binds ranks to some of the host's.
long cores_allowed(long online) {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return online;
  return CPU_COUNT(&set);
}

std::vector<DeviceInfo> of_kind(const std::vector<DeviceInfo>& all, bool gpu) {
  std::vector<DeviceInfo> result;
  std::copy_if(all.begin(), all.end(), std::back_inserter(result),
               [gpu](const DeviceInfo& device) { return device.gpu == gpu; });
  return result;
}

std::string list(const std::vector<DeviceInfo>& all) {
  std::string text;
  for (size_t i = 0; i < all.size(); ++i) text += fmt::format("{}{} = {}", i > 0 ? ", " : "", i, all[i].name);
  return text;
}

}  // namespace

void share_cores(LocalRank local) {
  constexpr const char* variable = "POCL_MAX_PTHREAD_COUNT";
  const long online = sysconf(_SC_NPROCESSORS_ONLN);
  const long share = std::max(1L, online / local.count);
  const long allowed = cores_allowed(online);
  setenv(variable, std::to_string(std::min(share, allowed)).c_str(), 0);
  if (allowed < share && local.index == 0)
    spdlog::warn(
        "ranks are bound to {} of {} cores each; on a CPU device `mpirun --bind-to none` gives them {}",
        allowed, online, share);
}

DeviceInfo choose_device(const std::string& wish, LocalRank local) {
  const std::vector<DeviceInfo> all = devices();
  if (all.empty())
    throw std::runtime_error(
        "no OpenCL device: no platform answers; install pocl-opencl-icd for the CPU, or the "
        "OpenCL driver of the GPU's vendor (for NVIDIA: nvidia-opencl-icd)");
  const std::vector<DeviceInfo> gpus = of_kind(all, true), others = of_kind(all, false);
  if (wish.empty() || wish == "gpu") {
    if (!gpus.empty()) {
      if (local.count > static_cast<int>(gpus.size()) && local.index == 0)
        spdlog::info("{} ranks share {} GPU{}", local.count, gpus.size(), gpus.size() == 1 ? "" : "s");
      return gpus[static_cast<size_t>(local.index) % gpus.size()];
    }
    if (wish == "gpu") throw std::runtime_error("no OpenCL device: no GPU among " + list(all));
    return others.front();
  }
  if (wish == "cpu") {
    if (others.empty())
      throw std::runtime_error("no OpenCL device: no CPU among " + list(all) + "; install pocl-opencl-icd");
    return others.front();
  }
  size_t index = 0;
  const auto [end, error] = std::from_chars(wish.data(), wish.data() + wish.size(), index);
  if (error != std::errc() || end != wish.data() + wish.size())
    throw std::runtime_error("--device takes cpu, gpu or an index, found \"" + wish + "\"");
  if (index >= all.size())
    throw std::runtime_error(fmt::format("no OpenCL device {}; there are: {}", index, list(all)));
  return all[index];
}

}  // namespace cohort
