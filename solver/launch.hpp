#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "solver/device.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// Launches kernels and keeps, for each, the number of calls, the bytes it must move and its device time. Times come
/// from launches made while `profile(true)`; the others are assumed to cost the same.
class Launcher {
 public:
  explicit Launcher(Device& device) : device_(device) {}

  /// A kernel with its place in the performance report.
  struct Handle {
    cl::Kernel kernel;
    std::size_t entry;
  };
  Handle handle(const cl::Program& program, const std::string& name) {
    return {cl::Kernel(program, name.c_str()), entry(name)};
  }

  /// Sets the arguments in order and enqueues. bytes: least traffic of this call.
  template <typename... Arguments>
  void operator()(Handle& handle, const cl::NDRange& global, const cl::NDRange& local, double bytes,
                  const Arguments&... arguments) {
    cl_uint index = 0;
    (handle.kernel.setArg(index++, arguments), ...);
    enqueue(handle, global, local, bytes);
  }

  /// While on, launches go to the profiling queue and are timed. Waits for what is enqueued.
  void profile(bool on);
  /// The queue launches go to now.
  cl::CommandQueue& queue() { return profiling_ ? device_.profiling_queue() : device_.queue(); }

  std::vector<KernelPerformance> performance() const;
  Device& device() { return device_; }

 private:
  struct Entry {
    std::string name;
    std::int64_t calls = 0, timed = 0;
    double timed_ms = 0, bytes = 0;
  };
  std::size_t entry(std::string_view name);
  void enqueue(Handle& handle, const cl::NDRange& global, const cl::NDRange& local, double bytes);
  void collect();

  Device& device_;
  bool profiling_ = false;
  std::vector<Entry> entries_;
  std::vector<std::pair<std::size_t, cl::Event>> events_;
};

}  // namespace cohort
