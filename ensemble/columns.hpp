#pragma once

#include <array>
#include <cstddef>

#include "ensemble/schema.hpp"

namespace cohort {

/// Datasets of the store, in the order in which they stand in the file. `parameters` to `error_measured` have
/// a row for each member, `error_mean` to `error_model` one for each feature, those from `kernels` on one for
/// each performance slot. The group /checks holds the first of these too, a row for each check.
enum class Column {
  parameters,
  unit_parameters,
  status,
  reason,
  failed_at_ms,
  attempts,
  crashes,
  seed,
  round,
  rank,
  device,
  wall_s,
  setup_s,
  device_s,
  finished_unix_s,
  dt_ms,
  dx_mm,
  step_factor,
  crc32,
  ecg,
  pv_pressure,
  pv_volume,
  displacement,
  features,
  member_of_check,
  error_estimate,
  error_measured,
  error_checks,
  error_mean,
  error_rms,
  error_largest,
  error_left_out,
  error_left_out_constant,
  error_model,
  error_state,
  error_crc32,
  time_ecg_ms,
  time_pv_ms,
  time_displacement_ms,
  study_group,
  study_inside,
  study_outcome,
  kernels,
  calls,
  device_ms,
  bytes_per_call,
  triad,
  slot_device,
  simulated_ms,
  cell_updates,
  slot_wall_s
};
inline constexpr std::size_t column_count = static_cast<std::size_t>(Column::slot_wall_s) + 1;

enum class ElementType { f8, f4, i8, i4, u8, u4, u1, text };

/// One dataset: what its elements are, and whether it depends on how the campaign ran (which rank, when, how
/// often killed) rather than on the campaign alone.
struct ColumnSpec {
  const char* path;
  ElementType type;
  std::size_t text_bytes;
  bool run_dependent;
  const char* unit;  ///< nullptr where there is none, or one for each element of a row
  std::size_t element_bytes() const;
};

inline constexpr std::array<ColumnSpec, column_count> column_specs{{
    {"/parameters", ElementType::f8, 0, false, nullptr},
    {"/unit_parameters", ElementType::f8, 0, false, nullptr},
    {"/status", ElementType::u1, 0, false, nullptr},
    {"/members/reason", ElementType::text, reason_bytes, false, nullptr},
    {"/members/failed_at_ms", ElementType::f8, 0, false, "ms"},
    {"/members/attempts", ElementType::i4, 0, true, nullptr},
    {"/members/crashes", ElementType::i4, 0, true, nullptr},
    {"/members/seed", ElementType::u8, 0, false, nullptr},
    {"/members/round", ElementType::i4, 0, true, nullptr},
    {"/members/rank", ElementType::i4, 0, true, nullptr},
    {"/members/device", ElementType::text, device_bytes, true, nullptr},
    {"/members/wall_s", ElementType::f8, 0, true, "s"},
    {"/members/setup_s", ElementType::f8, 0, true, "s"},
    {"/members/device_s", ElementType::f8, 0, true, "s"},
    {"/members/finished_unix_s", ElementType::f8, 0, true, "s"},
    {"/members/dt_ms", ElementType::f8, 0, false, "ms"},
    {"/members/dx_mm", ElementType::f8, 0, false, "mm"},
    {"/members/step_factor", ElementType::f8, 0, false, nullptr},
    {"/members/crc32", ElementType::u4, 0, false, nullptr},
    {"/ecg", ElementType::f4, 0, false, "mV"},
    {"/pv/pressure", ElementType::f4, 0, false, "mmHg"},
    {"/pv/volume", ElementType::f4, 0, false, "mL"},
    {"/displacement", ElementType::f4, 0, false, "mm"},
    {"/features", ElementType::f4, 0, false, nullptr},
    {"/member", ElementType::i8, 0, false, nullptr},
    {"/members/error_estimate", ElementType::f4, 0, false, nullptr},
    {"/members/error_measured", ElementType::u1, 0, false, nullptr},
    {"/errors/checks", ElementType::i4, 0, false, nullptr},
    {"/errors/mean", ElementType::f8, 0, false, nullptr},
    {"/errors/rms", ElementType::f8, 0, false, nullptr},
    {"/errors/largest", ElementType::f8, 0, false, nullptr},
    {"/errors/left_out_rms", ElementType::f8, 0, false, nullptr},
    {"/errors/left_out_rms_constant", ElementType::f8, 0, false, nullptr},
    {"/errors/model", ElementType::u1, 0, false, nullptr},
    {"/errors/state", ElementType::u1, 0, false, nullptr},
    {"/errors/crc32", ElementType::u4, 0, false, nullptr},
    {"/time/ecg_ms", ElementType::f8, 0, false, "ms"},
    {"/time/pv_ms", ElementType::f8, 0, false, "ms"},
    {"/time/displacement_ms", ElementType::f8, 0, false, "ms"},
    {"/study/group", ElementType::text, group_bytes, false, nullptr},
    {"/study/inside", ElementType::u1, 0, false, nullptr},
    {"/study/outcome", ElementType::text, reason_bytes, false, nullptr},
    {"/performance/kernels", ElementType::text, kernel_name_bytes, true, nullptr},
    {"/performance/calls", ElementType::i8, 0, true, nullptr},
    {"/performance/device_ms", ElementType::f8, 0, true, "ms"},
    {"/performance/bytes_per_call", ElementType::f8, 0, true, "B"},
    {"/performance/triad_GB_per_s", ElementType::f8, 0, true, "GB/s"},
    {"/performance/device", ElementType::text, device_bytes, true, nullptr},
    {"/performance/simulated_ms", ElementType::f8, 0, true, "ms"},
    {"/performance/cell_updates", ElementType::f8, 0, true, nullptr},
    {"/performance/wall_s", ElementType::f8, 0, true, "s"},
}};

constexpr const ColumnSpec& spec(Column column) {
  return column_specs[static_cast<std::size_t>(column)];
}

inline std::size_t ColumnSpec::element_bytes() const {
  switch (type) {
    case ElementType::f8:
    case ElementType::i8:
    case ElementType::u8:
      return 8;
    case ElementType::f4:
    case ElementType::i4:
    case ElementType::u4:
      return 4;
    case ElementType::u1:
      return 1;
    case ElementType::text:
      return text_bytes;
  }
  return 0;
}

/// Series and their times, which a campaign has only where it records them.
constexpr bool is_series(Column column) {
  return (column >= Column::ecg && column <= Column::displacement) ||
         (column >= Column::time_ecg_ms && column <= Column::time_displacement_ms);
}

/// What tells the errors of a campaign with checks.
constexpr bool is_of_errors(Column column) {
  return column >= Column::error_estimate && column <= Column::error_crc32;
}

/// Datasets that a file has only where they have rows: series, errors, what a study adds, and those that
/// belong to the checks or to the members alone.
constexpr bool is_optional(Column column) {
  return is_series(column) || is_of_errors(column) || column == Column::member_of_check ||
         (column >= Column::study_group && column <= Column::study_outcome) || column >= Column::kernels;
}

/// Shape of a dataset under a schema, rows first. What is optional and not there has no rows and is left out
/// of the file.
std::vector<std::size_t> shape(Column column, const Schema& schema);

}  // namespace cohort
