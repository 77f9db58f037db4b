#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "solver/device.hpp"
#include "solver/precision.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// Kernel arguments of the device's type `real` or `real4`.
struct Real {
  double value;
};
struct Real4 {
  double x, y, z, w;
};
/// A struct of so many `real`, by value.
struct Reals {
  std::vector<double> values;
};

/// Launches kernels and keeps, for each, the number of calls, the bytes it must move and its device time.
/// Times come from launches made while `profile(true)`; the others are assumed to cost the same.
class Launcher {
 public:
  /// `precision` is that of the kernels' type `real`.
  Launcher(Device& device, Precision precision) : device_(device), precision_(precision) {}

  /// A kernel with its place in the performance report. It is created when it is first launched: one that
  /// never is does not exist.
  struct Handle {
    cl::Program program;
    std::size_t entry;
    Device::Counted counted;
  };
  Handle handle(const cl::Program& program, const std::string& name) { return {program, entry(name), {}}; }

  /// Sets the arguments in order and enqueues. bytes: least traffic of this call.
  template <typename... Arguments>
  void operator()(Handle& handle, const cl::NDRange& global, const cl::NDRange& local, double bytes,
                  const Arguments&... arguments) {
    if (handle.counted.kernel() == nullptr) create(handle);
    cl_uint index = 0;
    (set(handle.counted.kernel, index++, arguments), ...);
    enqueue(handle, global, local, bytes);
  }

  /// For kernels over few things, of which each is long: `count` work-items, in groups that fill a GPU's
  /// warps. Sets the count as one argument more; what is behind it, up to whole groups, must do nothing.
  template <typename... Arguments>
  void counted(Handle& handle, std::size_t count, double bytes, const Arguments&... arguments) {
    const std::size_t group = group_of_few();
    (*this)(handle, cl::NDRange((count + group - 1) / group * group), cl::NDRange(group), bytes, arguments...,
            static_cast<int>(count));
  }

  /// While on, launches go to the profiling queue and are timed. Waits for what is enqueued.
  void profile(bool on);
  /// While on, every launch is timed, whatever profile() asks for: for studies of run time.
  void time_every_launch(bool on);
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
  template <typename T>
  void set(cl::Kernel& kernel, cl_uint index, const T& argument) {
    if constexpr (std::is_same_v<T, Real>) {
      if (precision_ == Precision::double_)
        kernel.setArg(index, argument.value);
      else
        kernel.setArg(index, static_cast<float>(argument.value));
    } else if constexpr (std::is_same_v<T, Real4>) {
      const auto& [x, y, z, w] = argument;
      if (precision_ == Precision::double_)
        kernel.setArg(index, cl_double4{{x, y, z, w}});
      else
        kernel.setArg(index, cl_float4{{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z),
                                        static_cast<float>(w)}});
    } else if constexpr (std::is_same_v<T, Reals>) {
      const std::vector<std::byte> packed = pack(argument.values, precision_);
      kernel.setArg(index, packed.size(), packed.data());
    } else {
      kernel.setArg(index, argument);
    }
  }
  std::size_t entry(std::string_view name);
  std::size_t group_of_few() const;
  void create(Handle& handle);
  void enqueue(Handle& handle, const cl::NDRange& global, const cl::NDRange& local, double bytes);
  void collect();

  Device& device_;
  Precision precision_;
  bool profiling_ = false, every_ = false;
  std::vector<Entry> entries_;
  std::vector<std::pair<std::size_t, cl::Event>> events_;
};

}  // namespace cohort
