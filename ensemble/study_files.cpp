#include "ensemble/study_files.hpp"

#include <hdf5.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "ensemble/config.hpp"
#include "ensemble/hdf5.hpp"

namespace cohort {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& file, const std::string& why) {
  throw ConfigError({fmt::format("{}: {}", file, why)});
}

/// Throws where no file of that name can be made or replaced.
void check_writable(const fs::path& file) {
  const fs::path folder = file.parent_path().empty() ? "." : file.parent_path();
  if (!fs::is_directory(folder)) refuse(file, fmt::format("{} is no folder", folder.string()));
  if (fs::is_directory(file)) refuse(file, "it is a folder");
  if (access(folder.c_str(), W_OK) != 0)
    refuse(file, fmt::format("cannot be written: {}", std::strerror(errno)));
}

constexpr const char* advice = "the study would replace it; move it away, or call the store by another name";

/// Throws where another file of that name stands there, one that begins otherwise.
void check_text(const fs::path& file, const std::string& begin, const char* what) {
  check_writable(file);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return;
  std::string found(begin.size(), '\0');
  stream.read(found.data(), static_cast<std::streamsize>(found.size()));
  if (found != begin) refuse(file, fmt::format("is no {}; {}", what, advice));
}

/// The kind that a study has written into its file; empty where it is no such file.
std::string kind_of(const fs::path& file) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  if (H5Fis_hdf5(file.c_str()) <= 0) return {};
  try {
    const hdf5::Handle handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, file);
    return hdf5::read_text(handle, "kind");
  } catch (const std::runtime_error&) {
    return {};
  }
}

}  // namespace

void check_work_precision_files(const Study& study, const std::string& measurements) {
  const fs::path store = study.store;
  check_writable(store);
  if (fs::exists(store) && kind_of(store) != "work_precision")
    refuse(store, fmt::format("is no file of such a study; {}", advice));
  check_text(fs::path(store).replace_extension(".csv"), "scene,setting,set,", "table of such a study");
  if (!measurements.empty()) check_text(measurements, "# Measured by `cohort study`", "file of measurements");
}

void check_stability_files(const Study& study) {
  check_text(fs::path(study.store).replace_extension(".csv"), "case,group,outcome,", "table of such a study");
}

}  // namespace cohort
