#include "ensemble/store.hpp"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <system_error>

#include "ensemble/hdf5.hpp"

namespace cohort {
namespace {

constexpr int most_axes = 4;
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// What the checksum of a row covers, in this order, and after them the status byte. `seed` differs from row
/// to row: a row that stands in another's place is found too.
constexpr Column checksummed[] = {
    Column::seed,      Column::parameters,   Column::unit_parameters, Column::ecg,    Column::pv_pressure,
    Column::pv_volume, Column::displacement, Column::features,        Column::reason, Column::failed_at_ms,
    Column::dt_ms,     Column::dx_mm,        Column::step_factor};

std::string system_message(int error) {
  return std::generic_category().message(error);
}

template <typename T>
std::vector<char> bytes_of(std::span<const T> values) {
  const auto raw = std::as_bytes(values);
  const auto* first = reinterpret_cast<const char*>(raw.data());
  return {first, first + raw.size()};
}

template <typename T>
std::vector<char> bytes_of(const T& value) {
  return bytes_of(std::span<const T>(&value, 1));
}

/// Text of a fixed length, cut before a UTF-8 sequence that does not fit.
std::vector<char> bytes_of_text(std::string_view text, std::size_t length) {
  if (text.size() > length) {
    std::size_t end = length;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text = text.substr(0, end);
  }
  std::vector<char> bytes(length, '\0');
  std::copy(text.begin(), text.end(), bytes.begin());
  return bytes;
}

std::vector<char> bytes_of_floats(const std::vector<float>& values, std::size_t row_bytes, const char* what) {
  const std::size_t count = row_bytes / sizeof(float);
  if (values.empty())
    return bytes_of(std::span<const float>(std::vector<float>(count, static_cast<float>(NaN))));
  if (values.size() != count)
    throw std::logic_error(fmt::format("a recording has {} numbers of {}, the store has room for {}",
                                       values.size(), what, count));
  return bytes_of(std::span<const float>(values));
}

std::uint32_t add_to_checksum(std::uint32_t sum, const std::vector<char>& bytes) {
  if (bytes.empty()) return sum;  // zlib takes a null pointer for a request of the initial value
  return static_cast<std::uint32_t>(
      ::crc32(sum, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

/// Writes all of it, whatever the signals. Returns 0 or errno. Safe in a signal handler.
int write_all(int file, const char* bytes, std::size_t count, off_t offset) {
  while (count > 0) {
    const auto written = pwrite(file, bytes, count, offset);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written < 0 ? errno : EIO;
    bytes += written;
    offset += written;
    count -= static_cast<std::size_t>(written);
  }
  return 0;
}

/// As /members/step_factor has it.
int halvings_of(double step_factor) {
  return step_factor > 0 ? static_cast<int>(std::lround(-std::log2(step_factor))) : 0;
}

double unix_seconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

int write_rows(int file, std::span<const RowImage> rows) {
  for (const auto part : {&RowImage::data_, &RowImage::account_, &RowImage::status_}) {
    for (const auto& row : rows)
      for (const auto& piece : row.*part)
        if (const int error = write_all(file, piece.bytes.data(), piece.bytes.size(), piece.offset);
            error != 0)
          return error;
    if (fdatasync(file) != 0) return errno;
  }
  return 0;
}

Store::Store(const std::filesystem::path& path, Access access, const std::string& group) : path_(path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const std::string name = path.string();
  file_ = open(name.c_str(), (access == Access::write ? O_RDWR : O_RDONLY) | O_CLOEXEC);
  if (file_ < 0)
    throw std::runtime_error(
        name + (access == Access::write ? ": cannot be opened for writing: " : ": cannot be opened: ") +
        system_message(errno));
  try {
    const hdf5::Handle properties(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, name);
    hdf5::check(H5Pset_file_locking(properties, false, true), name);
    if (H5Fis_hdf5(name.c_str()) <= 0)
      throw std::runtime_error(name + ": is not a cohort file (it is not HDF5)");
    const hdf5::Handle file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, properties), H5Fclose, name);
    if (hdf5::read_text(file, "format") != "cohort")
      throw std::runtime_error(
          name + ": is not a cohort file (HDF5, but its attribute \"format\" is not \"cohort\")");
    sha256_ = hdf5::read_text(file, "sha256");
    campaign_ = hdf5::read_text(file, "campaign");
    for (std::size_t i = 0; i < column_count; ++i) {
      const std::string dataset_path = group + column_specs[i].path;
      if (H5Lexists(file, dataset_path.c_str(), H5P_DEFAULT) <= 0) continue;  // a series that is not recorded
      const hdf5::Handle dataset(H5Dopen2(file, dataset_path.c_str(), H5P_DEFAULT), H5Dclose, name);
      const hdf5::Handle space(H5Dget_space(dataset), H5Sclose, name);
      const hdf5::Handle type(H5Dget_type(dataset), H5Tclose, name);
      hsize_t sizes[most_axes] = {};
      const int rank = H5Sget_simple_extent_ndims(space);
      const bool version_1 = static_cast<Column>(i) == Column::error_estimate && rank == 1;
      const std::size_t element_bytes = version_1 ? sizeof(double) : column_specs[i].element_bytes();
      if (rank < 1 || rank > most_axes || H5Tget_size(type) != element_bytes)
        throw std::runtime_error(name + ": " + dataset_path +
                                 " has another shape or type than this version of cohort writes");
      hdf5::check(H5Sget_simple_extent_dims(space, sizes, nullptr), name);
      std::size_t row_bytes = element_bytes;
      for (int axis = 1; axis < rank; ++axis) row_bytes *= sizes[axis];
      const haddr_t offset = H5Dget_offset(dataset);
      if (offset == HADDR_UNDEF && sizes[0] * row_bytes > 0)
        throw std::runtime_error(name + ": " + dataset_path + " has no fixed place in the file");
      (version_1 ? unwritten_error_ : extents_[i]) = {offset == HADDR_UNDEF ? 0 : static_cast<off_t>(offset),
                                                      sizes[0], row_bytes};
      if (static_cast<Column>(i) == Column::features) {
        features_ = hdf5::read_texts(dataset, "names");
        feature_units_ = hdf5::read_texts(dataset, "units");
      }
    }
    if (rows(Column::status) == 0)
      throw std::runtime_error(name + ": is not a cohort file (it has no /status)");
  } catch (...) {
    ::close(file_);
    throw;
  }
}

Store::~Store() {
  ::close(file_);
}

void Store::require(const Schema& schema) const {
  if (sha256_ != schema.sha256)
    throw std::runtime_error(fmt::format(
        "{}: was made by another campaign (its text is in the file's attribute `campaign`); its "
        "sha256 is {}, of this one {}; give this campaign another store, or the file another name{}",
        path_.string(), sha256_, schema.sha256,
        unwritten_error_.rows > 0 ? "; it is of version 1: finish it with the version of cohort that began it"
                                  : ""));
  for (std::size_t i = 0; i < column_count; ++i) {
    const auto sizes = shape(static_cast<Column>(i), schema);
    if (static_cast<Column>(i) >= Column::kernels) break;  // how many may report is the file's to say
    std::size_t row_bytes = column_specs[i].element_bytes();
    for (std::size_t axis = 1; axis < sizes.size(); ++axis) row_bytes *= sizes[axis];
    if (extents_[i].rows != sizes[0] || (sizes[0] > 0 && extents_[i].row_bytes != row_bytes))
      throw std::runtime_error(
          fmt::format("{}: {} has {} rows of {} bytes, this version of cohort needs {} of {}; finish the "
                      "campaign with the version that began it",
                      path_.string(), column_specs[i].path, extents_[i].rows, extents_[i].row_bytes, sizes[0],
                      row_bytes));
  }
}

std::vector<char> Store::read_rows(Column column, std::size_t first, std::size_t count) const {
  return read_at(extent(column), first, count);
}

std::vector<char> Store::read_at(const Extent& at, std::size_t first, std::size_t count) const {
  std::vector<char> bytes(at.rows == 0 ? 0 : count * at.row_bytes);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto got = pread(file_, bytes.data() + done, bytes.size() - done,
                           at.offset + static_cast<off_t>(first * at.row_bytes + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0)
      throw std::runtime_error(path_.string() + ": cannot be read: " +
                               (got < 0 ? system_message(errno) : "it has been cut short"));
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

template <typename T>
T Store::read_value(Column column, std::size_t row) const {
  T value{};
  const auto bytes = read_row(column, row);
  std::memcpy(&value, bytes.data(), std::min(sizeof value, bytes.size()));
  return value;
}

void Store::write_rows_at(Column column, std::size_t first, std::span<const char> bytes) {
  const auto& at = extent(column);
  if (const int error =
          write_all(file_, bytes.data(), bytes.size(), at.offset + static_cast<off_t>(first * at.row_bytes));
      error != 0)
    throw std::runtime_error(path_.string() + ": cannot be written: " + system_message(error));
}

void Store::flush() {
  if (fdatasync(file_) != 0)
    throw std::runtime_error(path_.string() + ": cannot be written: " + system_message(errno));
}

RowImage::Piece Store::piece(Column column, std::size_t row, std::vector<char> bytes) const {
  const auto& at = extent(column);
  if (bytes.size() != (at.rows == 0 ? 0 : at.row_bytes))
    throw std::logic_error(std::string("wrong size for ") + spec(column).path);
  return {at.offset + static_cast<off_t>(row * at.row_bytes), std::move(bytes)};
}

std::vector<Status> Store::statuses() const {
  const auto bytes = read_rows(Column::status, 0, rows(Column::status));
  std::vector<Status> result(bytes.size());
  std::transform(bytes.begin(), bytes.end(), result.begin(),
                 [](char byte) { return static_cast<Status>(byte); });
  return result;
}

Status Store::status(std::int64_t member) const {
  return read_value<Status>(Column::status, static_cast<std::size_t>(member));
}

void Store::set_status(std::int64_t member, Status status) {
  write_rows_at(Column::status, static_cast<std::size_t>(member), bytes_of(status));
}

Account Store::account(std::int64_t member) const {
  const auto row = static_cast<std::size_t>(member);
  const auto device = read_row(Column::device, row);
  return {read_value<std::int32_t>(Column::attempts, row),
          halvings_of(read_value<double>(Column::step_factor, row)),
          read_value<std::int32_t>(Column::crashes, row), read_value<std::int32_t>(Column::rank, row),
          std::string(device.begin(), std::find(device.begin(), device.end(), '\0'))};
}

std::string Store::reason(std::int64_t member) const {
  const auto text = read_row(Column::reason, static_cast<std::size_t>(member));
  return {text.begin(), std::find(text.begin(), text.end(), '\0')};
}

double Store::finished_unix_s(std::int64_t member) const {
  return number(Column::finished_unix_s, member);
}

double Store::number(Column column, std::int64_t member) const {
  return read_value<double>(column, static_cast<std::size_t>(member));
}

std::vector<float> Store::floats(Column column, std::int64_t member) const {
  const auto bytes = read_row(column, static_cast<std::size_t>(member));
  std::vector<float> result(bytes.size() / sizeof(float));
  std::memcpy(result.data(), bytes.data(), result.size() * sizeof(float));
  return result;
}

void Store::write_outcome(std::int64_t member, const std::string& outcome) {
  write_rows_at(Column::study_outcome, static_cast<std::size_t>(member),
                bytes_of_text(outcome, row_bytes(Column::study_outcome)));
}

RowImage Store::prepare(std::int64_t member, const Samples& samples, const Recording& recording,
                        const Account& account) const {
  const auto row = static_cast<std::size_t>(member);
  const auto slice = [&](const std::vector<double>& table) {
    const std::size_t width = samples.paths.size();
    return bytes_of(std::span(table).subspan(row * width, width));
  };
  RowImage image;
  std::uint32_t sum = 0;
  for (const auto column : checksummed) {
    if (!is_series(column) || rows(column) > 0) {
      auto bytes = [&]() -> std::vector<char> {
        switch (column) {
          case Column::seed:
            return read_row(column, row);
          case Column::parameters:
            return slice(samples.physical);
          case Column::unit_parameters:
            return slice(samples.unit);
          case Column::ecg:
            return bytes_of_floats(recording.ecg, row_bytes(column), "the ECG");
          case Column::pv_pressure:
            return bytes_of_floats(recording.pressure, row_bytes(column), "pressure");
          case Column::pv_volume:
            return bytes_of_floats(recording.volume, row_bytes(column), "volume");
          case Column::displacement:
            return bytes_of_floats(recording.displacement, row_bytes(column), "displacement");
          case Column::features:
            return bytes_of_floats(recording.features, row_bytes(column), "features");
          case Column::reason:
            return bytes_of_text(recording.reason, reason_bytes);
          case Column::failed_at_ms:
            return bytes_of(recording.failed_at_ms);
          case Column::dt_ms:
            return bytes_of(recording.dt_ms);
          case Column::dx_mm:
            return bytes_of(recording.dx_mm);
          case Column::step_factor:
            return bytes_of(step_factor(account.halvings));
          default:
            throw std::logic_error(std::string("no checksum covers ") + spec(column).path);
        }
      }();
      sum = add_to_checksum(sum, bytes);
      image.data_.push_back(piece(column, row, std::move(bytes)));
    }
  }
  sum = add_to_checksum(sum, read_at(unwritten_error_, row, 1));
  const auto status = bytes_of(status_of(recording.outcome));
  sum = add_to_checksum(sum, status);

  const auto add = [&](Column column, std::vector<char> bytes) {
    image.account_.push_back(piece(column, row, std::move(bytes)));
  };
  add(Column::crc32, bytes_of(sum));
  add(Column::attempts, bytes_of(static_cast<std::int32_t>(account.attempts)));
  add(Column::crashes, bytes_of(static_cast<std::int32_t>(account.crashes)));
  add(Column::rank, bytes_of(static_cast<std::int32_t>(account.rank)));
  add(Column::device, bytes_of_text(account.device, device_bytes));
  add(Column::wall_s, bytes_of(recording.wall_s));
  add(Column::setup_s, bytes_of(recording.setup_s));
  add(Column::device_s, bytes_of(recording.device_s));
  add(Column::finished_unix_s, bytes_of(unix_seconds()));
  image.status_.push_back(piece(Column::status, row, status));
  return image;
}

RowImage Store::prepare_requeue(std::int64_t member, const Account& account,
                                const std::string& reason) const {
  const auto row = static_cast<std::size_t>(member);
  RowImage image;
  if (!reason.empty())  // before the halving that it is the reason of
    image.account_.push_back(piece(Column::reason, row, bytes_of_text(reason, reason_bytes)));
  image.account_.push_back(
      piece(Column::attempts, row, bytes_of(static_cast<std::int32_t>(account.attempts))));
  image.account_.push_back(piece(Column::crashes, row, bytes_of(static_cast<std::int32_t>(account.crashes))));
  if (rows(Column::step_factor) > 0)
    image.account_.push_back(piece(Column::step_factor, row, bytes_of(step_factor(account.halvings))));
  image.status_.push_back(piece(Column::status, row, bytes_of(Status::queued)));
  return image;
}

void Store::commit(std::span<const RowImage> images) {
  if (const int error = write_rows(file_, images); error != 0)
    throw std::runtime_error(path_.string() + ": cannot be written: " + system_message(error));
}

bool Store::row_is_intact(std::int64_t member) const {
  const auto row = static_cast<std::size_t>(member);
  std::uint32_t sum = 0;
  for (const auto column : checksummed) sum = add_to_checksum(sum, read_row(column, row));
  sum = add_to_checksum(sum, read_at(unwritten_error_, row, 1));
  sum = add_to_checksum(sum, read_row(Column::status, row));
  return sum == read_value<std::uint32_t>(Column::crc32, row);
}

void Store::write_performance(int slot, const ProcessPerformance& performance) {
  const auto row = static_cast<std::size_t>(slot);
  const std::size_t capacity = row_bytes(Column::calls) / sizeof(std::int64_t);
  std::vector<char> names;
  std::vector<std::int64_t> calls(capacity, 0);
  std::vector<double> device_ms(capacity, NaN), bytes_per_call(capacity, NaN);
  for (std::size_t i = 0; i < capacity; ++i) {
    const bool known = i < performance.kernels.size();
    const auto name = bytes_of_text(known ? performance.kernels[i].kernel : "", kernel_name_bytes);
    names.insert(names.end(), name.begin(), name.end());
    if (!known) continue;
    calls[i] = performance.kernels[i].calls;
    device_ms[i] = performance.kernels[i].device_ms;
    bytes_per_call[i] = performance.kernels[i].bytes_per_call;
  }
  write_rows_at(Column::kernels, row, names);
  write_rows_at(Column::calls, row, bytes_of(std::span<const std::int64_t>(calls)));
  write_rows_at(Column::device_ms, row, bytes_of(std::span<const double>(device_ms)));
  write_rows_at(Column::bytes_per_call, row, bytes_of(std::span<const double>(bytes_per_call)));
  write_rows_at(Column::triad, row, bytes_of(performance.triad_GB_per_s));
  write_rows_at(Column::slot_device, row, bytes_of_text(performance.device, device_bytes));
  write_rows_at(Column::simulated_ms, row, bytes_of(performance.simulated_ms));
  write_rows_at(Column::cell_updates, row, bytes_of(performance.cell_updates));
  write_rows_at(Column::slot_wall_s, row, bytes_of(performance.wall_s));
}

}  // namespace cohort
