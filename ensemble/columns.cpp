#include "ensemble/columns.hpp"

namespace cohort {

std::vector<std::size_t> shape(Column column, const Schema& schema) {
  const auto members = static_cast<std::size_t>(schema.members);
  const auto slots = static_cast<std::size_t>(schema.performance_slots);
  const auto checked_members = schema.checked.empty() ? 0 : members;
  const auto& layout = schema.layout;
  switch (column) {
    case Column::parameters:
    case Column::unit_parameters:
      return {members, schema.parameters.size()};
    case Column::ecg:
      return {layout.leads.empty() ? 0 : members, layout.leads.size(), layout.ecg_ms.size()};
    case Column::pv_pressure:
    case Column::pv_volume:
      return {layout.compartments.empty() ? 0 : members, layout.compartments.size(), layout.pv_ms.size()};
    case Column::displacement:
      return {layout.points.empty() ? 0 : members, layout.points.size(), 3, layout.displacement_ms.size()};
    case Column::features:
      return {members, layout.features.size()};
    case Column::member_of_check:
      return {schema.member_of_check.size()};
    case Column::error_estimate:
      return {checked_members, layout.features.size()};
    case Column::error_measured:
      return {checked_members};
    case Column::error_checks:
    case Column::error_mean:
    case Column::error_rms:
    case Column::error_largest:
    case Column::error_left_out:
    case Column::error_left_out_constant:
    case Column::error_model:
      return {schema.checked.empty() ? 0 : layout.features.size()};
    case Column::error_state:
    case Column::error_crc32:
      return {schema.checked.empty() ? std::size_t{0} : std::size_t{1}};
    case Column::time_ecg_ms:
      return {layout.leads.empty() ? 0 : layout.ecg_ms.size()};
    case Column::time_pv_ms:
      return {layout.compartments.empty() ? 0 : layout.pv_ms.size()};
    case Column::time_displacement_ms:
      return {layout.points.empty() ? 0 : layout.displacement_ms.size()};
    case Column::study_group:
    case Column::study_inside:
    case Column::study_outcome:
      return {schema.study.groups.size()};
    case Column::kernels:
    case Column::calls:
    case Column::device_ms:
    case Column::bytes_per_call:
      return {slots, static_cast<std::size_t>(schema.kernels_per_slot)};
    case Column::triad:
    case Column::slot_device:
    case Column::simulated_ms:
    case Column::cell_updates:
    case Column::slot_wall_s:
      return {slots};
    default:
      return {members};
  }
}

}  // namespace cohort
