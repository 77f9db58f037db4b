#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ensemble/members.hpp"

namespace cohort {

/// State of a row. The numbers stand in /status; from `done` on they are those of Outcome.
enum class Status : std::uint8_t { empty, queued, running, done, failed, timeout, unstable, rejected };
inline constexpr std::array<const char*, 8> status_names{"empty",  "queued",  "running",  "done",
                                                         "failed", "timeout", "unstable", "rejected"};
constexpr bool is_final(Status status) {
  return status >= Status::done;
}
constexpr Status status_of(Outcome outcome) {
  return static_cast<Status>(outcome);
}

inline constexpr std::size_t reason_bytes = 192, device_bytes = 64, kernel_name_bytes = 64, group_bytes = 64;

/// A sampled parameter as the file describes it.
struct ParameterColumn {
  std::string path, unit;
  double lower, upper;
  std::string scale;  ///< "linear" or "log"
  std::string prior;  ///< "uniform [0.5, 1.5]", "normal 10 +- 1 in [7, 14]", "choice {1, 2}", "csv", "table"
};

/// Where the checks of a campaign stand in its store.
inline constexpr const char* checks_group = "/checks";

/// All that is fixed when a store is created, or a part of it: its checks have a schema of their own.
struct Schema {
  std::string group;  ///< "" or checks_group
  std::string campaign, sha256, program_version;
  std::uint64_t seed = 0;
  std::int64_t members = 0;
  std::vector<ParameterColumn> parameters;  ///< (P)
  Samples samples;                          ///< (N, P)
  Layout layout;
  std::vector<std::int64_t> checked;          ///< members that are run again (choose_checks.hpp)
  double error_order = 1;                     ///< that error estimates assume (error_order())
  std::vector<std::int64_t> member_of_check;  ///< in the schema of the checks: whose check a row is
  StudyMembers study;                         ///< empty where the campaign is not one of a study
  int performance_slots = 64;                 ///< processes that may report their kernels' times
  int kernels_per_slot = 48;
};

/// The schema of a campaign. `program_version` without a date or a machine: it stands in the file.
Schema make_schema(const Campaign& campaign, Samples samples, Layout layout, std::string program_version);

/// Order in the spacing and the step that error estimates of a scene assume, as measured
/// (ensemble/README.md): 2 of a circulation alone; 1 of what has tissue, whose features come through surfaces
/// in steps of cells and arrival times.
double error_order(const Scene& scene);

/// The schema of the checks of a campaign: a row for each member that is checked, features alone.
Schema checks_schema(const Schema& schema);

}  // namespace cohort
