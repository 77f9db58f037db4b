#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "ensemble/store.hpp"

namespace cohort {

inline constexpr int exit_interrupted = 3;

/// What to write should the process have to leave while a batch runs: the rows of its members, ready made.
struct LastWill {
  std::vector<RowImage> crash;    ///< a fatal signal (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT)
  std::vector<RowImage> hang;     ///< the batch does not come back
  std::vector<RowImage> abandon;  ///< SIGTERM or SIGINT, and the batch takes longer than the grace
};

/// Watches over batches: a thread that leaves the process (exit_interrupted) when a batch hangs or has to be
/// abandoned, and handlers of fatal signals. Either writes the batch's last will first. One at a time in a
/// process.
class BatchGuard {
 public:
  /// `grace`: how long a batch may run on after an interrupt. A second interrupt ends it at once.
  BatchGuard(int file, std::chrono::duration<double> hang_after, std::chrono::duration<double> grace);
  ~BatchGuard();
  BatchGuard(const BatchGuard&) = delete;
  BatchGuard& operator=(const BatchGuard&) = delete;

  void begin(LastWill will);
  /// The batch is back. Does not return where the watchdog has begun to write its last will.
  void end();

 private:
  void watch(std::stop_token stop);

  int file_;
  std::chrono::duration<double> hang_after_, grace_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool running_ = false;
  std::chrono::steady_clock::time_point begun_;
  LastWill will_;
  std::jthread thread_;
};

}  // namespace cohort
