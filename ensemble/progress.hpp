#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "ensemble/store.hpp"

namespace cohort {

/// How many rows are in each state.
struct StatusCounts {
  std::array<std::int64_t, status_names.size()> by_status{};
  explicit StatusCounts(const std::vector<Status>& statuses);
  std::int64_t operator[](Status status) const { return by_status[static_cast<std::size_t>(status)]; }
  std::int64_t total() const;
  std::int64_t ended() const;   ///< done, failed, timeout, unstable, rejected
  std::int64_t failed() const;  ///< ended and not done
};

/// "37/64 done, 2 failed, 8 running | 1240 hearts/h | 0:01:18 left". The rate is unknown until the first
/// member ends.
std::string progress_line(const StatusCounts& counts, std::optional<double> hearts_per_hour);

/// Hours, minutes and seconds, "1:02:03".
std::string duration_text(double seconds);

/// Shows how a campaign goes, from /status alone: one line that is drawn again on a terminal (standard
/// error), else a line in the log every `log_every`. Runs in a thread of its own until it is destroyed, which
/// shows the last state. With a group of the store, of its checks.
class Progress {
 public:
  explicit Progress(const std::filesystem::path& store,
                    std::chrono::duration<double> log_every = std::chrono::seconds(30),
                    const std::string& group = "");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

 private:
  void show(bool last);

  Store store_;
  std::string prefix_;
  bool terminal_;
  std::chrono::duration<double> every_;
  std::chrono::steady_clock::time_point begun_;
  std::int64_t done_before_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::jthread thread_;
};

}  // namespace cohort
