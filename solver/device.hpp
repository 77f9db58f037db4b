#pragma once

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#include <CL/opencl.hpp>
#include <cstdint>
#include <memory>
#include <source_location>
#include <string>
#include <vector>

#include "solver/footprint.hpp"

namespace cohort {

/// What is wrong with a device, and no member's matter.
class DeviceError : public std::exception {
 public:
  explicit DeviceError(std::string what) : what_(std::move(what)) {}
  /// The call that failed and its error by name, as of cl.h.
  explicit DeviceError(const cl::Error& error);
  const char* what() const noexcept override { return what_.c_str(); }

 private:
  std::string what_;
};

struct DeviceInfo {
  std::string name, platform,
      unique_id;  ///< unique_id: PCI address or UUID where the driver tells, else platform and index
  bool gpu;
  std::size_t memory_bytes;
  cl::Device handle;
};

/// Every OpenCL device of every platform, GPUs first, then by unique id: the same order on every rank of a
/// host.
std::vector<DeviceInfo> devices();

/// The device of one rank, with its context and queues.
class Device {
 public:
  explicit Device(const DeviceInfo& info);

  const DeviceInfo& info() const { return info_; }
  const cl::Context& context() const { return context_; }
  cl::CommandQueue& queue() { return queue_; }
  /// Same device, with profiling: a command's event tells its device time.
  cl::CommandQueue& profiling_queue() { return profiling_queue_; }

  /// Lanes of the explicit vectors that hot kernels use: 1 on GPUs, 8 on CPUs (4 in double precision).
  int vector_width(bool double_precision) const;

  /// Whether kernels may use double precision.
  bool has_double() const;

  /// Local memory of a work-group.
  std::size_t local_bytes() const;

  /// Whether a kernel takes an argument of so many bytes beside some dozens of others.
  bool fits_argument(std::size_t bytes) const;

  /// Builds `files` of kernels/ joined in order behind common.clh, each after a #line directive; an entry of
  /// more than one line is no file but generated source that stands between them. With `definitions` as -D
  /// options ("NAME" or "NAME=value"; what begins with a dash stands as it is) and `generated` source in
  /// front. Programs are kept: the same request compiles once. Throws std::runtime_error with the build log.
  cl::Program build(const std::vector<std::string>& files, const std::vector<std::string>& definitions,
                    const std::string& generated = {});

  /// Options that cap a program's registers at `count` where the driver takes one (NVIDIA's), else none: more
  /// work-groups are then resident and hide the latency of memory.
  std::vector<std::string> register_cap(int count) const;

  static constexpr std::size_t least_bytes = 64;  ///< of a buffer
  /// Device memory, uninitialised. name: what a plan calls it. Throws std::runtime_error naming the bytes
  /// when it cannot be had.
  cl::Buffer allocate(std::size_t bytes, const std::string& name = {},
                      const std::source_location& where = std::source_location::current());
  /// Of allocate(), and not released yet.
  std::size_t allocated_bytes() const { return memory_->now(); }
  /// The most there were at once since the start, or since restart_peak().
  std::size_t peak_bytes() const { return memory_->peak(); }
  void restart_peak() { memory_->restart_peak(); }

  /// A kernel, and its place among those that count_launch() counts.
  struct Counted {
    cl::Kernel kernel;
    std::size_t place;
  };
  Counted kernel(const cl::Program& program, const std::string& name);
  void count_launch(std::size_t place) { ++kernels_[place].launches; }
  /// Programs asked for, launches and memory since restart_footprint().
  Footprint footprint() const;
  void restart_footprint();

  /// GB/s of c = a + 3 b over arrays well beyond the caches, best of a few; measured once.
  double triad_GB_per_s();

 private:
  DeviceInfo info_;
  cl::Context context_;
  cl::CommandQueue queue_, profiling_queue_;
  struct Built {
    std::string request, file;
    cl::Program program;
    bool asked_for;  ///< since restart_footprint()
  };
  struct KernelUse {
    cl_program program;
    std::string name;
    std::int64_t launches;
  };
  std::vector<Built> programs_;
  std::vector<KernelUse> kernels_;
  std::shared_ptr<MemoryLedger> memory_ = std::make_shared<MemoryLedger>();  ///< buffers may outlive this
  double triad_ = 0;
};

/// Source of a file of kernels/ by its path below it ("cells/mitchell_schaeffer.cl"): embedded at build time,
/// or read from the folder that the environment variable COHORT_KERNELS names. Throws std::out_of_range.
std::string kernel_source(const std::string& file);
/// Paths of all embedded kernel files, sorted.
std::vector<std::string> kernel_files();

}  // namespace cohort
