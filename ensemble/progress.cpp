#include "ensemble/progress.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <numeric>

namespace cohort {

StatusCounts::StatusCounts(const std::vector<Status>& statuses) {
  for (const auto status : statuses) {
    const auto index = static_cast<std::size_t>(status);
    if (index < by_status.size()) ++by_status[index];
  }
}

std::int64_t StatusCounts::total() const {
  return std::accumulate(by_status.begin(), by_status.end(), std::int64_t{0});
}

std::int64_t StatusCounts::ended() const {
  return (*this)[Status::done] + failed();
}

std::int64_t StatusCounts::failed() const {
  return (*this)[Status::failed] + (*this)[Status::timeout] + (*this)[Status::unstable] +
         (*this)[Status::rejected];
}

std::string duration_text(double seconds) {
  const auto whole = std::llround(seconds);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string progress_line(const StatusCounts& counts, std::optional<double> hearts_per_hour) {
  std::string line = fmt::format("{}/{} done, {} failed, {} running", counts[Status::done], counts.total(),
                                 counts.failed(), counts[Status::running]);
  if (!hearts_per_hour || *hearts_per_hour <= 0) return line;
  line += fmt::format(" | {:.0f} hearts/h", *hearts_per_hour);
  const auto left = counts.total() - counts.ended();
  if (left > 0)
    line += fmt::format(" | {} left", duration_text(static_cast<double>(left) / *hearts_per_hour * 3600));
  return line;
}

Progress::Progress(const std::filesystem::path& store, std::chrono::duration<double> log_every,
                   const std::string& group)
    : store_(store, Store::Access::read, group),
      prefix_(group.empty() ? "" : "checks: "),
      terminal_(isatty(STDERR_FILENO) != 0),
      every_(terminal_ ? std::chrono::duration<double>(0.5) : log_every),
      begun_(std::chrono::steady_clock::now()),
      done_before_(StatusCounts(store_.statuses())[Status::done]) {
  thread_ = std::jthread([this](std::stop_token stop) {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, stop, every_, [&] { return stop.stop_requested(); })) show(false);
  });
}

Progress::~Progress() {
  thread_.request_stop();
  thread_.join();
  show(true);
}

void Progress::show(bool last) try {
  const StatusCounts counts(store_.statuses());
  const auto done = counts[Status::done] - done_before_;
  const double hours =
      std::chrono::duration<double, std::ratio<3600>>(std::chrono::steady_clock::now() - begun_).count();
  const auto rate = done > 0 ? std::optional(static_cast<double>(done) / hours) : std::nullopt;
  const auto line = prefix_ + progress_line(counts, rate);
  if (terminal_) {
    std::fprintf(stderr, "\r\033[K%s%s", line.c_str(), last ? "\n" : "");
    std::fflush(stderr);
  } else {
    spdlog::info("{}", line);
  }
} catch (const std::exception& error) {
  spdlog::warn("progress: {}", error.what());  // a display must not end a campaign
}

}  // namespace cohort
