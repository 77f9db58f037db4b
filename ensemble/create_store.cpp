#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <numeric>
#include <system_error>

#include "ensemble/error_model.hpp"
#include "ensemble/hdf5.hpp"
#include "ensemble/random.hpp"
#include "ensemble/store.hpp"

// Rows are written in the byte order of the file, which is that of every machine this program runs on.
static_assert(std::endian::native == std::endian::little);

namespace cohort {
namespace {

namespace fs = std::filesystem;
constexpr hsize_t page_bytes = 4096;
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

std::string system_message(int error) {
  return std::generic_category().message(error);
}

std::runtime_error cannot_create(const fs::path& path, const std::string& why) {
  return std::runtime_error(path.string() + ": cannot be created: " + why);
}

std::size_t elements(const std::vector<std::size_t>& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

hdf5::Handle element_type(const ColumnSpec& column) {
  if (column.type == ElementType::text) {
    hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose, column.path);
    hdf5::check(H5Tset_size(type, column.text_bytes), column.path);
    hdf5::check(H5Tset_strpad(type, H5T_STR_NULLPAD), column.path);
    hdf5::check(H5Tset_cset(type, H5T_CSET_UTF8), column.path);
    return type;
  }
  const auto id = [&]() -> hid_t {
    switch (column.type) {
      case ElementType::f4:
        return H5T_IEEE_F32LE;
      case ElementType::i8:
        return H5T_STD_I64LE;
      case ElementType::i4:
        return H5T_STD_I32LE;
      case ElementType::u8:
        return H5T_STD_U64LE;
      case ElementType::u4:
        return H5T_STD_U32LE;
      case ElementType::u1:
        return H5T_STD_U8LE;
      default:
        return H5T_IEEE_F64LE;
    }
  }();
  return hdf5::Handle(H5Tcopy(id), H5Tclose, column.path);
}

bool is_float(ElementType type) {
  return type == ElementType::f8 || type == ElementType::f4;
}

hdf5::Handle create_dataset(hid_t file, Column column, const Schema& schema) {
  const auto& spec = cohort::spec(column);
  const auto sizes = shape(column, schema);
  const std::vector<hsize_t> extents(sizes.begin(), sizes.end());
  const hdf5::Handle space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr),
                           H5Sclose, spec.path);
  const hdf5::Handle type = element_type(spec);
  const hdf5::Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, spec.path);
  hdf5::check(H5Pset_layout(properties, H5D_CONTIGUOUS), spec.path);
  hdf5::check(H5Pset_alloc_time(properties, H5D_ALLOC_TIME_EARLY), spec.path);
  hdf5::check(H5Pset_fill_time(properties, H5D_FILL_TIME_ALLOC), spec.path);
  hdf5::check(H5Pset_obj_track_times(properties, false),
              spec.path);  // a date would make two equal stores differ
  if (is_float(spec.type)) hdf5::check(H5Pset_fill_value(properties, H5T_NATIVE_DOUBLE, &NaN), spec.path);
  const std::string path = schema.group + spec.path;
  hdf5::Handle dataset(H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT),
                       H5Dclose, spec.path);
  if (spec.unit) hdf5::write_attribute(dataset, "units", std::string(spec.unit));
  return dataset;
}

template <typename T>
void write_dataset(hid_t dataset, hid_t type, const std::vector<T>& values) {
  if (!values.empty())
    hdf5::check(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "write");
}

/// Texts that are no longer than `bytes`.
void write_texts(hid_t dataset, const std::vector<std::string>& texts, std::size_t bytes) {
  std::vector<char> packed(texts.size() * bytes, '\0');
  for (std::size_t i = 0; i < texts.size(); ++i) texts[i].copy(&packed[i * bytes], bytes);
  const hdf5::Handle type(H5Dget_type(dataset), H5Tclose, "type");
  write_dataset(dataset, type, packed);
}

void write_rate(hid_t dataset, const std::vector<double>& times_ms) {
  if (times_ms.size() > 1) hdf5::write_attribute(dataset, "rate_hz", 1000 / (times_ms[1] - times_ms[0]));
}

/// Attributes and what is known before the first member runs.
void describe(hid_t dataset, Column column, const Schema& schema) {
  const auto& layout = schema.layout;
  if (column == Column::parameters) {
    std::vector<std::string> names, units, scales, priors;
    std::vector<double> lower, upper;
    for (const auto& p : schema.parameters) {
      names.push_back(p.path);
      units.push_back(p.unit);
      scales.push_back(p.scale);
      priors.push_back(p.prior);
      lower.push_back(p.lower);
      upper.push_back(p.upper);
    }
    hdf5::write_attribute(dataset, "names", names);
    hdf5::write_attribute(dataset, "units", units);
    hdf5::write_attribute(dataset, "lower", lower);
    hdf5::write_attribute(dataset, "upper", upper);
    hdf5::write_attribute(dataset, "scale", scales);
    hdf5::write_attribute(dataset, "prior", priors);
    write_dataset(dataset, H5T_NATIVE_DOUBLE, schema.samples.physical);
  } else if (column == Column::unit_parameters) {
    write_dataset(dataset, H5T_NATIVE_DOUBLE, schema.samples.unit);
  } else if (column == Column::status) {
    hdf5::write_attribute(dataset, "legend",
                          std::vector<std::string>(status_names.begin(), status_names.end()));
    const std::vector<std::uint8_t> queued(static_cast<std::size_t>(schema.members),
                                           static_cast<std::uint8_t>(Status::queued));
    write_dataset(dataset, H5T_NATIVE_UINT8, queued);
  } else if (column == Column::seed) {
    std::vector<std::uint64_t> seeds;
    for (std::int64_t i = 0; i < schema.members; ++i) {
      const auto member =
          schema.member_of_check.empty() ? i : schema.member_of_check[static_cast<std::size_t>(i)];
      seeds.push_back(random_bits(schema.seed, Stream::member, 0, static_cast<std::uint64_t>(member)));
    }
    write_dataset(dataset, H5T_NATIVE_UINT64, seeds);
  } else if (column == Column::step_factor) {
    write_dataset(dataset, H5T_NATIVE_DOUBLE,
                  std::vector<double>(static_cast<std::size_t>(schema.members), 1));
  } else if (column == Column::rank) {
    write_dataset(dataset, H5T_NATIVE_INT32,
                  std::vector<std::int32_t>(static_cast<std::size_t>(schema.members), -1));
  } else if (column == Column::ecg) {
    hdf5::write_attribute(dataset, "leads", layout.leads);
    write_rate(dataset, layout.ecg_ms);
  } else if (column == Column::pv_pressure || column == Column::pv_volume) {
    hdf5::write_attribute(dataset, "compartments", layout.compartments);
    write_rate(dataset, layout.pv_ms);
  } else if (column == Column::displacement) {
    hdf5::write_attribute(dataset, "points", layout.points);
    write_rate(dataset, layout.displacement_ms);
  } else if (column == Column::features) {
    hdf5::write_attribute(dataset, "names", layout.features);
    hdf5::write_attribute(dataset, "units", layout.feature_units);
  } else if (column == Column::member_of_check) {
    write_dataset(dataset, H5T_NATIVE_INT64, schema.member_of_check);
  } else if (column == Column::error_model) {
    hdf5::write_attribute(dataset, "legend",
                          std::vector<std::string>(error_model_names.begin(), error_model_names.end()));
  } else if (column == Column::time_ecg_ms) {
    write_dataset(dataset, H5T_NATIVE_DOUBLE, layout.ecg_ms);
  } else if (column == Column::time_pv_ms) {
    write_dataset(dataset, H5T_NATIVE_DOUBLE, layout.pv_ms);
  } else if (column == Column::time_displacement_ms) {
    write_dataset(dataset, H5T_NATIVE_DOUBLE, layout.displacement_ms);
  } else if (column == Column::study_group) {
    write_texts(dataset, schema.study.groups, spec(column).text_bytes);
  } else if (column == Column::study_inside) {
    write_dataset(dataset, H5T_NATIVE_UINT8, schema.study.inside);
  }
}

std::string now() {
  const std::time_t time = std::time(nullptr);
  char text[32];
  std::tm utc;
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&time, &utc));
  return text;
}

void write_root(hid_t file, const Schema& schema) {
  hdf5::write_attribute(file, "format", std::string("cohort"));
  hdf5::write_attribute(file, "version", std::uint64_t{2});
  hdf5::write_attribute(file, "campaign", schema.campaign);
  hdf5::write_attribute(file, "sha256", schema.sha256);
  hdf5::write_attribute(file, "seed", schema.seed);
  hdf5::write_attribute(file, "program_version", schema.program_version);
  hdf5::write_attribute(file, "created", now());
  // What may differ between two runs of one campaign: datasets by path, attributes of the root after an @.
  std::vector<std::string> run_dependent{"@created"};
  for (const auto& column : column_specs)
    if (column.run_dependent) run_dependent.push_back(column.path);
  if (!schema.checked.empty())
    for (std::size_t i = 0; i < column_count; ++i)
      if (column_specs[i].run_dependent && !is_optional(static_cast<Column>(i)))
        run_dependent.push_back(std::string(checks_group) + column_specs[i].path);
  hdf5::write_attribute(file, "run_dependent", run_dependent);
}

void create_group(hid_t file, const std::string& name) {
  const hdf5::Handle properties(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, name);
  hdf5::check(H5Pset_obj_track_times(properties, false), name);
  hdf5::Handle(H5Gcreate2(file, name.c_str(), H5P_DEFAULT, properties, H5P_DEFAULT), H5Gclose, name)
      .close(name);
}

/// The datasets of the members, or of the checks.
void write_group(hid_t file, const Schema& schema) {
  create_group(file, schema.group + "/members");
  if (schema.group.empty()) {
    create_group(file, "/time");
    create_group(file, "/performance");
  }
  if (!schema.layout.compartments.empty()) create_group(file, schema.group + "/pv");
  if (!schema.checked.empty()) create_group(file, "/errors");
  if (!schema.study.groups.empty()) create_group(file, "/study");
  for (std::size_t i = 0; i < column_count; ++i) {
    const auto column = static_cast<Column>(i);
    if (is_optional(column) && shape(column, schema)[0] == 0) continue;
    hdf5::Handle dataset = create_dataset(file, column, schema);
    describe(dataset, column, schema);
    dataset.close(spec(column).path);
  }
}

void describe_errors(hid_t file, const Schema& schema) {
  const std::string name = "/errors";
  const hdf5::Handle errors(H5Gopen2(file, name.c_str(), H5P_DEFAULT), H5Gclose, name);
  hdf5::write_attribute(errors, "names", schema.layout.features);
  hdf5::write_attribute(errors, "units", schema.layout.feature_units);
  hdf5::write_attribute(errors, "order", schema.error_order);
}

void write_hdf5(const fs::path& path, const Schema& schema) {
  const std::string what = "HDF5";
  const hdf5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, what);
  hdf5::check(H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18), what);
  hdf5::check(H5Pset_alignment(access, 1, page_bytes), what);
  hdf5::check(H5Pset_small_data_block_size(access, 0), what);  // else small datasets share a block, unaligned
  hdf5::check(H5Pset_file_locking(access, false, true), what);  // flock fails on some shared file systems
  hdf5::Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, what);
  write_root(file, schema);
  write_group(file, schema);
  if (!schema.checked.empty()) {
    create_group(file, checks_group);
    write_group(file, checks_schema(schema));
    describe_errors(file, schema);
  }
  file.close("HDF5");
}

/// A temporary file, removed unless it is renamed.
class Temporary {
 public:
  explicit Temporary(const fs::path& store) : store_(store) {
    char host[256] = "host";
    gethostname(host, sizeof host - 1);
    path_ = fmt::format("{}.creating.{}.{}", store.string(), host, getpid());
    file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file_ < 0) throw cannot_create(store, system_message(errno));
  }
  ~Temporary() {
    close(file_);
    if (!renamed_) unlink(path_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  const fs::path& path() const { return path_; }

  /// Reserves blocks, so that no row can find the disk full later.
  void reserve(std::size_t bytes) const {
    if (const int error = posix_fallocate(file_, 0, static_cast<off_t>(bytes)); error != 0)
      throw cannot_create(store_, fmt::format("{} (it takes {} bytes)", system_message(error), bytes));
  }
  std::size_t size() const { return static_cast<std::size_t>(lseek(file_, 0, SEEK_END)); }

  void rename_to_store() {
    if (fsync(file_) != 0) throw cannot_create(store_, system_message(errno));
    // Never replaces a store that another job made meanwhile, where the file system can promise that.
    int result = renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, store_.c_str(), RENAME_NOREPLACE);
    if (result != 0 && (errno == EINVAL || errno == ENOSYS))
      result = std::rename(path_.c_str(), store_.c_str());
    if (result != 0) throw cannot_create(store_, system_message(errno));
    renamed_ = true;
    const fs::path folder = store_.has_parent_path() ? store_.parent_path() : ".";
    if (const int directory = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); directory >= 0) {
      fsync(directory);
      close(directory);
    }
  }

 private:
  fs::path store_, path_;
  int file_ = -1;
  bool renamed_ = false;
};

/// Temporaries of processes that were killed. Who calls this holds the creation lock, so no other process
/// makes one now.
void remove_stale_temporaries(const fs::path& store) {
  const fs::path folder = store.has_parent_path() ? store.parent_path() : ".";
  const auto prefix = store.filename().string() + ".creating.";
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with(prefix)) {
      spdlog::info("removing {}, left by a process that ended while it created the store",
                   entry.path().string());
      std::error_code ignored;
      fs::remove(entry.path(), ignored);
    }
}

std::size_t data_bytes(const Schema& schema) {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < column_count; ++i)
    bytes += elements(shape(static_cast<Column>(i), schema)) * column_specs[i].element_bytes() + page_bytes;
  return schema.checked.empty() ? bytes : bytes + data_bytes(checks_schema(schema));
}

void require_room(const fs::path& store, std::size_t bytes) {
  struct statvfs disk;
  const fs::path folder = store.has_parent_path() ? store.parent_path() : ".";
  if (statvfs(folder.c_str(), &disk) != 0) return;
  const auto available = static_cast<std::size_t>(disk.f_bavail) * disk.f_frsize;
  if (available < bytes)
    throw cannot_create(store, fmt::format("no space left on the disk: the store takes {} bytes, {} are free",
                                           bytes, available));
}

class CreationLock {
 public:
  explicit CreationLock(Claims& claims) : claims_(claims) { claims.begin_creation(); }
  ~CreationLock() { claims_.end_creation(); }
  CreationLock(const CreationLock&) = delete;
  CreationLock& operator=(const CreationLock&) = delete;

 private:
  Claims& claims_;
};

}  // namespace

bool create_store(const fs::path& path, const Schema& schema, Claims& claims) {
  const CreationLock lock(claims);
  if (fs::exists(path)) return false;
  if (claims.work()) remove_stale_temporaries(path);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  require_room(path, data_bytes(schema));
  Temporary temporary(path);
  temporary.reserve(data_bytes(schema));
  try {
    write_hdf5(temporary.path(), schema);
  } catch (const std::exception& error) {
    throw cannot_create(path, error.what());
  }
  temporary.reserve(temporary.size());
  claims.forget_kills();
  temporary.rename_to_store();
  return true;
}

}  // namespace cohort
