#include "solver/device.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

namespace cohort {

extern const std::map<std::string, std::string> embedded_kernels;

namespace {

// Tokens of cl_khr_device_uuid, cl_khr_pci_bus_info and cl_nv_device_attribute_query; the 1.2 headers lack
// some.
constexpr cl_device_info device_uuid_khr = 0x106A;
constexpr cl_device_info device_pci_bus_nv = 0x4008;
constexpr cl_device_info device_pci_slot_nv = 0x4009;
constexpr cl_device_info device_pci_domain_nv = 0x400A;

std::string unique_id(const cl::Device& device, const std::string& fallback) {
  const std::string extensions = device.getInfo<CL_DEVICE_EXTENSIONS>();
  if (extensions.find("cl_khr_device_uuid") != std::string::npos) {
    std::array<unsigned char, 16> uuid{};
    if (clGetDeviceInfo(device(), device_uuid_khr, uuid.size(), uuid.data(), nullptr) == CL_SUCCESS) {
      std::string text = "uuid ";
      for (const unsigned char byte : uuid) {
        std::array<char, 3> hex{};
        std::snprintf(hex.data(), hex.size(), "%02x", byte);
        text += hex.data();
      }
      return text;
    }
  }
  if (extensions.find("cl_nv_device_attribute_query") != std::string::npos) {
    cl_uint bus = 0, slot = 0, domain = 0;
    if (clGetDeviceInfo(device(), device_pci_bus_nv, sizeof bus, &bus, nullptr) == CL_SUCCESS &&
        clGetDeviceInfo(device(), device_pci_slot_nv, sizeof slot, &slot, nullptr) == CL_SUCCESS) {
      clGetDeviceInfo(device(), device_pci_domain_nv, sizeof domain, &domain, nullptr);
      std::array<char, 32> text{};
      std::snprintf(text.data(), text.size(), "pci %04x:%02x:%02x", domain, bus, slot);
      return text.data();
    }
  }
  return fallback;
}

}  // namespace

DeviceError::DeviceError(const cl::Error& error) : what_(error.what()) {
  static const std::map<cl_int, const char*> names = {
      {CL_DEVICE_NOT_AVAILABLE, "CL_DEVICE_NOT_AVAILABLE"},
      {CL_MEM_OBJECT_ALLOCATION_FAILURE, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
      {CL_OUT_OF_RESOURCES, "CL_OUT_OF_RESOURCES"},
      {CL_OUT_OF_HOST_MEMORY, "CL_OUT_OF_HOST_MEMORY"},
      {CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST, "CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST"},
      {CL_INVALID_VALUE, "CL_INVALID_VALUE"},
      {CL_INVALID_CONTEXT, "CL_INVALID_CONTEXT"},
      {CL_INVALID_COMMAND_QUEUE, "CL_INVALID_COMMAND_QUEUE"},
      {CL_INVALID_MEM_OBJECT, "CL_INVALID_MEM_OBJECT"},
      {CL_INVALID_KERNEL_ARGS, "CL_INVALID_KERNEL_ARGS"},
      {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE"},
      {-9999, "NVIDIA: illegal read or write"}};
  const auto name = names.find(error.err());
  what_ += (name == names.end() ? ": error" : std::string(": ") + name->second) + " (" +
           std::to_string(error.err()) + ")";
}

std::vector<DeviceInfo> devices() {
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return {};  // the loader answers CL_PLATFORM_NOT_FOUND_KHR where no driver is installed
  }
  std::vector<DeviceInfo> result;
  for (const cl::Platform& platform : platforms) {
    std::vector<cl::Device> found;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &found);
    } catch (const cl::Error&) {
      continue;  // a platform without devices
    }
    const std::string platform_name = platform.getInfo<CL_PLATFORM_NAME>();
    for (size_t i = 0; i < found.size(); ++i) {
      const cl::Device& device = found[i];
      result.push_back({device.getInfo<CL_DEVICE_NAME>(), platform_name,
                        unique_id(device, platform_name + " " + std::to_string(i)),
                        (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_GPU) != 0,
                        static_cast<size_t>(device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>()), device});
    }
  }
  std::sort(result.begin(), result.end(), [](const DeviceInfo& a, const DeviceInfo& b) {
    return std::tie(b.gpu, a.unique_id) < std::tie(a.gpu, b.unique_id);
  });
  // One GPU may answer through two platforms: the first by name stands.
  result.erase(std::unique(result.begin(), result.end(),
                           [](const DeviceInfo& a, const DeviceInfo& b) {
                             return a.gpu && b.gpu && a.unique_id == b.unique_id;
                           }),
               result.end());
  return result;
}

Device::Device(const DeviceInfo& info)
    : info_(info),
      context_(info.handle),
      queue_(context_, info.handle),
      profiling_queue_(context_, info.handle, CL_QUEUE_PROFILING_ENABLE) {}

int Device::vector_width(bool double_precision) const {
  if (info_.gpu) return 1;
  return double_precision ? 4 : 8;
}

bool Device::has_double() const {
  return info_.handle.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0;
}

std::size_t Device::local_bytes() const {
  return static_cast<std::size_t>(info_.handle.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>());
}

bool Device::fits_argument(std::size_t bytes) const {
  constexpr std::size_t others = 512;
  return bytes + others <= info_.handle.getInfo<CL_DEVICE_MAX_PARAMETER_SIZE>();
}

cl::Program Device::build(const std::vector<std::string>& files, const std::vector<std::string>& definitions,
                          const std::string& generated) {
  std::string source;
  if (!generated.empty()) source += "#line 1 \"generated\"\n" + generated + "\n";
  std::vector<std::string> joined = {"common.clh"};
  joined.insert(joined.end(), files.begin(), files.end());
  for (const std::string& file : joined) {
    const bool text = file.find('\n') != std::string::npos;
    source +=
        "#line 1 \"" + (text ? "generated" : file) + "\"\n" + (text ? file : kernel_source(file)) + "\n";
  }

  std::string options = "-cl-std=CL1.2";
  if (info_.gpu) options += " -DGPU";
  for (const std::string& definition : definitions)
    options += definition.starts_with("-") ? " " + definition : " -D" + definition;

  const std::string key = options + "\n" + source;
  for (Built& built : programs_) {
    if (built.request != key) continue;
    built.asked_for = true;
    return built.program;
  }

  cl::Program program(context_, source);
  try {
    program.build({info_.handle}, options.c_str());
  } catch (const cl::Error& error) {
    throw std::runtime_error("OpenCL build of " + files.back() + " failed (" + std::to_string(error.err()) +
                             ") with " + options + ":\n" +
                             program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(info_.handle));
  }
  programs_.push_back({key, files.back(), program, true});
  return program;
}

Device::Counted Device::kernel(const cl::Program& program, const std::string& name) {
  Counted result{cl::Kernel(program, name.c_str()), 0};
  for (const KernelUse& known : kernels_) {
    if (known.program == program() && known.name == name) return result;
    ++result.place;
  }
  kernels_.push_back({program(), name, 0});
  return result;
}

Footprint Device::footprint() const {
  Footprint result;
  for (const Built& built : programs_) {
    if (!built.asked_for) continue;
    ++result.programs;
    std::istringstream names(built.program.getInfo<CL_PROGRAM_KERNEL_NAMES>());
    for (std::string name; std::getline(names, name, ';');) {
      name = name.substr(0, name.find('\0'));
      const auto use = std::find_if(kernels_.begin(), kernels_.end(), [&](const KernelUse& known) {
        return known.program == built.program() && known.name == name;
      });
      result.kernels.push_back({built.file, name, use == kernels_.end() ? 0 : use->launches});
    }
  }
  result.buffers = memory_->at_peak();
  for (const Footprint::Buffer& buffer : result.buffers) result.peak_bytes += buffer.bytes;
  return result;
}

void Device::restart_footprint() {
  for (Built& built : programs_) built.asked_for = false;
  for (KernelUse& kernel : kernels_) kernel.launches = 0;
  memory_->restart_peak();
}

std::vector<std::string> Device::register_cap(int count) const {
  const std::string extensions = info_.handle.getInfo<CL_DEVICE_EXTENSIONS>();
  if (extensions.find("cl_nv_compiler_options") == std::string::npos) return {};
  return {"-cl-nv-maxrregcount=" + std::to_string(count)};
}

namespace {

/// One buffer in the ledger of its device.
struct Allocation {
  std::shared_ptr<MemoryLedger> ledger;
  std::size_t account, bytes;
};

void CL_CALLBACK released(cl_mem, void* data) {
  const std::unique_ptr<Allocation> allocation(static_cast<Allocation*>(data));
  allocation->ledger->give_back(allocation->account, allocation->bytes);
}

}  // namespace

cl::Buffer Device::allocate(std::size_t bytes, const std::string& name, const std::source_location& where) {
  try {
    const std::size_t taken = std::max(bytes, least_bytes);
    cl::Buffer buffer(context_, CL_MEM_READ_WRITE, taken);
    auto allocation = std::make_unique<Allocation>(Allocation{memory_, 0, taken});
    allocation->account = memory_->take(taken, name, where);
    buffer.setDestructorCallback(released, allocation.get());
    allocation.release();  // to the callback
    return buffer;
  } catch (const cl::Error& error) {
    throw std::runtime_error("cannot allocate " + std::to_string(bytes) + " bytes on " + info_.name + " (" +
                             std::to_string(error.err()) + "), with " + std::to_string(allocated_bytes()) +
                             " bytes allocated before");
  }
}

double Device::triad_GB_per_s() {
  if (triad_ > 0) return triad_;
  // Three arrays of 2 GiB on large GPUs, 128 MiB on CPUs: several times the last cache.
  const std::size_t most = info_.gpu ? std::size_t{1} << 29 : std::size_t{1} << 25;
  const std::size_t count =
      std::min(most, info_.memory_bytes / 128 / 4 * 4);  // a thirty-second of the memory each
  const cl::Program program = build({"triad.cl"}, {});
  std::array<cl::Buffer, 3> arrays;
  for (cl::Buffer& array : arrays) {
    array = cl::Buffer(context_, CL_MEM_READ_WRITE, count * sizeof(float));
    queue_.enqueueFillBuffer(array, 1.0f, 0, count * sizeof(float));
  }
  cl::Kernel kernel(program, "triad");
  for (cl_uint i = 0; i < 3; ++i) kernel.setArg(i, arrays[i]);
  constexpr int repetitions = 10;
  double best_s = 1e9;
  for (int repetition = 0; repetition < repetitions; ++repetition) {
    queue_.finish();
    const auto start = std::chrono::steady_clock::now();
    queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(count / 4), cl::NullRange);
    queue_.finish();
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (repetition > 0) best_s = std::min(best_s, elapsed.count());  // the first one warms up
  }
  float last = 0;
  queue_.enqueueReadBuffer(arrays[2], CL_TRUE, (count - 1) * sizeof(float), sizeof last, &last);
  if (last != 4.0f) throw std::runtime_error("the triad's answer is wrong on " + info_.name);
  triad_ = 3.0 * sizeof(float) * static_cast<double>(count) / best_s * 1e-9;
  return triad_;
}

std::string kernel_source(const std::string& file) {
  if (const char* folder = std::getenv("COHORT_KERNELS")) {
    std::ifstream stream(std::filesystem::path(folder) / file);
    if (!stream) throw std::out_of_range("no kernel file " + file + " in COHORT_KERNELS=" + folder);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
  }
  const auto it = embedded_kernels.find(file);
  if (it == embedded_kernels.end()) throw std::out_of_range("no kernel file " + file);
  return it->second;
}

std::vector<std::string> kernel_files() {
  std::vector<std::string> files;
  for (const auto& entry : embedded_kernels) files.push_back(entry.first);
  return files;
}

}  // namespace cohort
