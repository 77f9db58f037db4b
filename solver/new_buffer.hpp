#pragma once

#include <algorithm>
#include <vector>

#include "solver/launch.hpp"

namespace cohort {

/// A buffer with the numbers of `host`; of an empty one, room for one number.
template <typename T>
cl::Buffer upload_new(Launcher& launcher, const std::vector<T>& host, const std::string& name = {},
                      const std::source_location& where = std::source_location::current()) {
  const cl::Buffer buffer =
      launcher.device().allocate(std::max<std::size_t>(1, host.size()) * sizeof(T), name, where);
  if (!host.empty())
    launcher.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, host.size() * sizeof(T), host.data());
  return buffer;
}

}  // namespace cohort
