#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace cohort::test {

/// Kernels with a fault of their own, for as long as this lives: a copy of the folder in which `was` of one
/// file stands as `is`.
class FaultyKernels {
 public:
  FaultyKernels(const std::string& file, const std::string& was, const std::string& is)
      : folder_(std::filesystem::temp_directory_path() / ("kernels_" + std::to_string(getpid()))) {
    namespace fs = std::filesystem;
    fs::remove_all(folder_);
    fs::copy(COHORT_SOURCE_DIR "/kernels", folder_, fs::copy_options::recursive);
    std::ostringstream text;
    text << std::ifstream(folder_ / file).rdbuf();
    std::string source = text.str();
    const auto at = source.find(was);
    if (at == std::string::npos) throw std::invalid_argument(file + " has no \"" + was + "\"");
    source.replace(at, was.size(), is);
    std::ofstream(folder_ / file) << source;
    setenv("COHORT_KERNELS", folder_.c_str(), 1);
  }
  ~FaultyKernels() {
    unsetenv("COHORT_KERNELS");
    std::filesystem::remove_all(folder_);
  }
  FaultyKernels(const FaultyKernels&) = delete;
  FaultyKernels& operator=(const FaultyKernels&) = delete;

 private:
  std::filesystem::path folder_;
};

}  // namespace cohort::test
