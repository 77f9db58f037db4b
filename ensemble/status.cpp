#include "ensemble/status.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <thread>
#include <utility>

#include "ensemble/error_estimate.hpp"
#include "ensemble/interrupt.hpp"
#include "ensemble/progress.hpp"
#include "ensemble/table.hpp"

namespace cohort {
namespace {

/// "3, 5, 9 and 12 more"
std::string list_of(const std::vector<std::int64_t>& members) {
  constexpr std::size_t shown = 8;
  if (members.size() <= shown) return fmt::format("{}", fmt::join(members, ", "));
  return fmt::format("{} and {} more", fmt::join(members.begin(), members.begin() + shown, ", "),
                     members.size() - shown);
}

/// Counts by status.
std::string count_lines(const StatusCounts& counts) {
  std::string text;
  for (std::size_t i = 0; i < status_names.size(); ++i)
    if (counts.by_status[i] > 0) text += fmt::format("  {:<9} {}\n", status_names[i], counts.by_status[i]);
  return text;
}

/// Reasons of rows that ended otherwise than done, with their rows: of those that differ in numbers alone the
/// first one's.
std::string reason_lines(const Store& store, const std::vector<Status>& statuses, const char* rows) {
  std::map<std::pair<Status, std::string>, std::vector<std::int64_t>> reasons;
  for (std::size_t i = 0; i < statuses.size(); ++i)
    if (is_final(statuses[i]) && statuses[i] != Status::done)
      reasons[{statuses[i], masked(store.reason(static_cast<std::int64_t>(i)))}].push_back(
          static_cast<std::int64_t>(i));
  std::string text;
  for (const auto& [key, members] : reasons)
    text += fmt::format("{} x {}: {} ({} {})\n", members.size(),
                        status_names[static_cast<std::size_t>(key.first)], store.reason(members.front()),
                        rows, list_of(members));
  return text;
}

/// Rows that have ended and are not what was committed; they are put back to the queue.
struct Verified {
  std::int64_t checked = 0;
  std::vector<std::int64_t> bad;
};
Verified verify_rows(Store& store) {
  Verified verified;
  for (std::int64_t member = 0; member < store.members(); ++member) {
    if (!is_final(store.status(member))) continue;
    ++verified.checked;
    if (store.row_is_intact(member)) continue;
    verified.bad.push_back(member);
    store.commit(std::vector{store.prepare_requeue(member, {})});
  }
  return verified;
}

}  // namespace

int exit_code(const std::vector<Status>& statuses) {
  const StatusCounts counts(statuses);
  if (counts.ended() < static_cast<std::int64_t>(statuses.size())) return 3;
  return counts.failed() > 0 ? 2 : 0;
}

int exit_code(const Store& store) {
  const int code = exit_code(store.statuses());
  if (code == 3 || !store.has_checks()) return code;
  const auto checks = Store(store.path(), Store::Access::read, checks_group).statuses();
  return std::all_of(checks.begin(), checks.end(), is_final) ? code : 3;
}

std::optional<double> hearts_per_hour(const Store& store) {
  constexpr std::ptrdiff_t recent = 64;
  std::vector<double> times;
  const auto statuses = store.statuses();
  for (std::size_t i = 0; i < statuses.size(); ++i)
    if (statuses[i] == Status::done) times.push_back(store.finished_unix_s(static_cast<std::int64_t>(i)));
  std::erase_if(times, [](double t) { return std::isnan(t); });
  std::sort(times.begin(), times.end());
  if (std::ssize(times) > recent) times.erase(times.begin(), times.end() - recent);
  if (times.size() < 2) return std::nullopt;
  // The first of them only starts the clock; with it those that ended in the same batch.
  constexpr double same_batch_s = 0.01;
  const auto counted =
      std::count_if(times.begin(), times.end(), [&](double t) { return t > times.front() + same_batch_s; });
  if (counted == 0) return std::nullopt;
  return 3600 * static_cast<double>(counted) / (times.back() - times.front());
}

std::string status_report(const Store& store) {
  const auto statuses = store.statuses();
  const StatusCounts counts(statuses);
  std::string text =
      fmt::format("{}: {} members\n{}", store.path().string(), counts.total(), count_lines(counts));
  const auto rate = hearts_per_hour(store);
  if (rate) text += fmt::format("{:.0f} hearts per hour\n", *rate);
  const auto left = counts.total() - counts.ended();
  if (rate && left > 0)
    text += fmt::format("{} to the end\n", duration_text(static_cast<double>(left) / *rate * 3600));
  text += reason_lines(store, statuses, "members");
  if (!store.has_checks()) return text;
  const Store checks(store.path(), Store::Access::read, checks_group);
  const auto of_checks = checks.statuses();
  text += fmt::format("{} checks at half the spacing and the step\n{}{}", of_checks.size(),
                      count_lines(StatusCounts(of_checks)), reason_lines(checks, of_checks, "checks"));
  // Errors of before a row went back to the queue are not those of the campaign.
  if (has_errors(store) && exit_code(store) != 3) text += error_table(store);
  return text;
}

int status_command(const std::filesystem::path& path, bool watch) try {
  if (watch) catch_interrupts();
  const Store store(path);
  while (true) {
    const bool terminal = watch && isatty(STDOUT_FILENO);
    std::fputs((terminal ? "\033[H\033[J" + status_report(store) : status_report(store)).c_str(), stdout);
    std::fflush(stdout);
    if (!watch || exit_code(store) != 3) return 0;
    for (int tick = 0; tick < 20 && interrupts() == 0; ++tick)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (interrupts() > 0) return 0;
  }
} catch (const std::exception& error) {
  spdlog::error("{}", error.what());
  return 1;
}

int verify_command(const std::filesystem::path& path) try {
  Store store(path, Store::Access::write);
  const Verified members = verify_rows(store);
  fmt::print("{}: {} rows checked, {} bad\n", path.string(), members.checked, members.bad.size());
  if (!members.bad.empty()) fmt::print("back in the queue: members {}\n", list_of(members.bad));
  if (!store.has_checks()) return members.bad.empty() ? 0 : 3;

  Store rows(store.path(), Store::Access::write, checks_group);
  const Verified checks = verify_rows(rows);
  fmt::print("{} rows of checks, {} bad\n", checks.checked, checks.bad.size());
  if (!checks.bad.empty()) fmt::print("back in the queue: checks {}\n", list_of(checks.bad));
  const bool errors_intact = errors_are_intact(store);
  if (!errors_intact) fmt::print("errors are bad: the next run writes them again\n");
  if (members.bad.empty() && checks.bad.empty() && errors_intact) return 0;
  forget_errors(store);
  return 3;
} catch (const std::exception& error) {
  spdlog::error("{}", error.what());
  return 1;
}

}  // namespace cohort
