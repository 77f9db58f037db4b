#include "solver/launch.hpp"

namespace cohort {

std::size_t Launcher::entry(std::string_view name) {
  for (std::size_t i = 0; i < entries_.size(); ++i)
    if (entries_[i].name == name) return i;
  entries_.push_back({std::string(name)});
  return entries_.size() - 1;
}

void Launcher::create(Handle& handle) {
  handle.counted = device_.kernel(handle.program, entries_[handle.entry].name);
}

void Launcher::enqueue(Handle& handle, const cl::NDRange& global, const cl::NDRange& local, double bytes) {
  Entry& entry = entries_[handle.entry];
  ++entry.calls;
  device_.count_launch(handle.counted.place);
  entry.bytes += bytes;
  if (profiling_) {
    cl::Event event;
    device_.profiling_queue().enqueueNDRangeKernel(handle.counted.kernel, cl::NullRange, global, local,
                                                   nullptr, &event);
    events_.emplace_back(handle.entry, event);
    constexpr std::size_t most_events = 1 << 14;  // each holds some of the host's memory
    if (events_.size() == most_events) {
      queue().finish();
      collect();
    }
  } else {
    device_.queue().enqueueNDRangeKernel(handle.counted.kernel, cl::NullRange, global, local);
  }
}

std::size_t Launcher::group_of_few() const {
  constexpr std::size_t warp = 32;
  return device_.info().gpu ? warp : 1;
}

void Launcher::profile(bool on) {
  on = on || every_;
  if (on == profiling_) return;
  queue().finish();
  if (profiling_) collect();
  profiling_ = on;
}

void Launcher::time_every_launch(bool on) {
  every_ = on;
  profile(on);
}

void Launcher::collect() {
  for (const auto& [index, event] : events_) {
    const cl_ulong start = event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
    const cl_ulong end = event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
    entries_[index].timed_ms += static_cast<double>(end - start) * 1e-6;
    ++entries_[index].timed;
  }
  events_.clear();
}

std::vector<KernelPerformance> Launcher::performance() const {
  std::vector<KernelPerformance> result;
  for (const Entry& entry : entries_) {
    if (entry.calls == 0) continue;
    const double calls = static_cast<double>(entry.calls);
    const double each_ms = entry.timed > 0 ? entry.timed_ms / static_cast<double>(entry.timed) : 0;
    result.push_back({entry.name, entry.calls, each_ms * calls, entry.bytes / calls});
  }
  return result;
}

}  // namespace cohort
