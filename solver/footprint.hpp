#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <source_location>
#include <string>
#include <vector>

namespace cohort {

/// What was taken of a device since Device::restart_footprint().
struct Footprint {
  /// A kernel of a program that was asked for; one that is built with the others of its file and never
  /// launched has 0 launches.
  struct Kernel {
    std::string file;  ///< of kernels/, the last of its program
    std::string name;
    std::int64_t launches;
  };
  struct Buffer {
    std::string file;  ///< of solver/, without its ending: who allocated it
    std::string name;  ///< empty: none was given
    std::size_t bytes;
  };
  int programs = 0;             ///< different ones
  std::vector<Kernel> kernels;  ///< of these programs
  std::vector<Buffer> buffers;  ///< when most bytes were allocated, by name, largest first
  std::size_t peak_bytes = 0;   ///< their sum
  std::int64_t launches() const;
};

/// Device memory by who allocated it and under which name. Drivers give buffers back on threads of their
/// own.
class MemoryLedger {
 public:
  /// The place of an account.
  std::size_t take(std::size_t bytes, const std::string& name, const std::source_location& where);
  void give_back(std::size_t account, std::size_t bytes);
  std::size_t now() const;
  std::size_t peak() const;
  void restart_peak();
  std::vector<Footprint::Buffer> at_peak() const;

 private:
  struct Account {
    std::string file, name;
    std::size_t now, at_peak;
  };
  void remember_peak();

  mutable std::mutex mutex_;
  std::vector<Account> accounts_;
  std::size_t now_ = 0, peak_ = 0;
};

}  // namespace cohort
