#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/claims.hpp"
#include "ensemble/columns.hpp"
#include "ensemble/schema.hpp"

namespace cohort {

/// Creates the store whole: under a temporary name, with every byte of it allocated, flushed to the disk,
/// then renamed. A process killed meanwhile leaves a temporary that the next creation removes. Returns false,
/// without a change, where the file exists. Other processes that create the same store wait
/// (claims.begin_creation). Throws std::runtime_error: no such folder, not writable, too little room on the
/// disk (with the bytes named).
bool create_store(const std::filesystem::path& path, const Schema& schema, Claims& claims);

/// Bytes to be written to the file for one member, ready made, so that a signal handler can write them.
class RowImage {
 private:
  friend int write_rows(int file, std::span<const RowImage> rows);
  friend class Store;
  struct Piece {
    off_t offset;
    std::vector<char> bytes;
  };
  std::vector<Piece> data_, account_, status_;
};

/// Writes rows: all data, fdatasync; all checksums, counts and times, fdatasync; all status bytes, fdatasync.
/// Returns 0 or errno. Allocates nothing and calls nothing but pwrite and fdatasync: safe in a signal
/// handler.
int write_rows(int file, std::span<const RowImage> rows);

/// Who ran a member, and how often it has been tried.
struct Account {
  int attempts = 0;
  int halvings = 0;  ///< how often its steps have been halved: once for each attempt that ended unstable
  int crashes = 0;   ///< times that a process crashed or hung with this member among others in its batch
  int rank = 0;
  std::string device;
};

/// What the steps of a member are multiplied by that has ended unstable so often.
inline double step_factor(int halvings) {
  return std::ldexp(1.0, -halvings);
}

/// Times of the kernels of one process, as the report and the file show them.
struct ProcessPerformance {
  std::vector<KernelPerformance> kernels;
  std::string device;
  double triad_GB_per_s = 0, simulated_ms = 0, cell_updates = 0, wall_s = 0;
};

/// The shared HDF5 file of a campaign, once it is created. HDF5 reads where each dataset lies when the store
/// is opened and is closed again; rows are written in place with pwrite. Any number of processes may have it
/// open. A reader needs no lock.
class Store {
 public:
  enum class Access { read, write };

  /// Opens a store, or with `group` the rows of its checks. Throws std::runtime_error where the file is
  /// missing, cannot be read (or written), or is no store.
  explicit Store(const std::filesystem::path& path, Access access = Access::read,
                 const std::string& group = "");
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Throws std::runtime_error naming both checksums where the file belongs to another campaign than
  /// `schema`, or where it has another shape.
  void require(const Schema& schema) const;

  const std::filesystem::path& path() const { return path_; }
  std::int64_t members() const { return static_cast<std::int64_t>(rows(Column::status)); }
  const std::string& sha256() const { return sha256_; }
  const std::string& campaign() const { return campaign_; }
  int file() const { return file_; }

  /// Rows of a column; 0 where the file does not have it.
  std::size_t rows(Column column) const { return extent(column).rows; }
  /// Bytes of a row.
  std::size_t row_bytes(Column column) const { return extent(column).row_bytes; }
  /// Where a column begins in the file.
  off_t offset(Column column) const { return extent(column).offset; }

  std::vector<Status> statuses() const;
  Status status(std::int64_t member) const;
  void set_status(std::int64_t member, Status status);
  Account account(std::int64_t member) const;
  std::string reason(std::int64_t member) const;
  double finished_unix_s(std::int64_t member) const;

  /// What stands in a member's row of a column of f4: a series, or the features; nothing where there is none.
  std::vector<float> floats(Column column, std::int64_t member) const;
  /// A member's number in a column of f8 with one a row.
  double number(Column column, std::int64_t member) const;
  /// Text of a member in /study/outcome, cut at its length. Throws as commit.
  void write_outcome(std::int64_t member, const std::string& outcome);

  /// The bytes that a member's end writes. `samples` are those of the campaign: the row is written whole, so
  /// that a row that the disk has spoilt is repaired too. Throws std::logic_error where the recording does
  /// not fit the layout.
  RowImage prepare(std::int64_t member, const Samples& samples, const Recording& recording,
                   const Account& account) const;
  /// The bytes that put a member back to the queue, with its attempts so far and the step factor of the next.
  /// reason: why it is tried again, empty: what stands there stays.
  RowImage prepare_requeue(std::int64_t member, const Account& account, const std::string& reason = "") const;
  /// Writes rows in the order of write_rows. Throws std::runtime_error naming the file and the error of the
  /// system.
  void commit(std::span<const RowImage> images);

  /// Whether a finished row is what was committed: recomputes its checksum.
  bool row_is_intact(std::int64_t member) const;

  void write_performance(int slot, const ProcessPerformance& performance);

  /// Whether the campaign has checks, which then stand in checks_group.
  bool has_checks() const { return rows(Column::error_estimate) > 0; }
  /// Names and units of the features.
  const std::vector<std::string>& features() const { return features_; }
  const std::vector<std::string>& feature_units() const { return feature_units_; }

  /// The bytes of `count` rows from `first` on.
  std::vector<char> read_rows(Column column, std::size_t first, std::size_t count) const;
  /// Writes rows without a word about their order on the disk; `flush` has them there.
  void write_rows_at(Column column, std::size_t first, std::span<const char> bytes);
  void flush();

 private:
  struct Extent {
    off_t offset = 0;
    std::size_t rows = 0, row_bytes = 0;
  };
  const Extent& extent(Column column) const { return extents_[static_cast<std::size_t>(column)]; }
  std::vector<char> read_row(Column column, std::size_t row) const { return read_rows(column, row, 1); }
  std::vector<char> read_at(const Extent& at, std::size_t first, std::size_t count) const;
  template <typename T>
  T read_value(Column column, std::size_t row) const;
  RowImage::Piece piece(Column column, std::size_t row, std::vector<char> bytes) const;

  std::filesystem::path path_;
  std::string sha256_, campaign_;
  std::vector<std::string> features_, feature_units_;
  std::array<Extent, column_count> extents_;
  Extent unwritten_error_;  ///< in stores of version 1: a number of each row that was never written
  int file_ = -1;
};

}  // namespace cohort
