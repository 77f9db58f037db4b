// Device memory of the deforming tissue.
#include <algorithm>

#include "solver/precision.hpp"
#include "solver/solid.hpp"

namespace cohort {

std::vector<cl::Buffer> Solid::buffers() const {
  return {state_,
          member_of_cell_,
          member_of_node_,
          member_of_item_,
          cell_nodes_,
          share_,
          region_,
          direction_,
          activation_,
          tension_,
          u_,
          v_,
          force_,
          item_cell_,
          item_cavity_,
          item_share_,
          item_faces_,
          position_,
          lid_,
          gradient_,
          volume_,
          corners_,
          tile_slots_,
          slot_node_,
          cell_slots_,
          first_slot_,
          node_slots_,
          cavity_block_,
          cavity_ends_,
          moving_,
          pulls_,
          inverse_mass_,
          support_of_,
          support_,
          cavity_of_,
          cavity_first_,
          cavity_slots_,
          item_tile_slots_,
          item_slot_node_,
          item_slots_,
          cavity_gradient_,
          node_sums_,
          measures_,
          node_blocks_,
          cell_blocks_,
          item_blocks_,
          pressures_,
          inflation_,
          damping_,
          cell_bounds_,
          speeds_,
          dashpots_,
          drive_,
          drive_column_,
          series_};
}

// The buffers of the batch before, but for small ones.
void Solid::release() {
  for (cl::Buffer* buffer : {&cell_nodes_,
                             &tile_slots_,
                             &slot_node_,
                             &cell_slots_,
                             &first_slot_,
                             &node_slots_,
                             &share_,
                             &direction_,
                             &tension_,
                             &u_,
                             &v_,
                             &force_,
                             &item_share_,
                             &item_faces_,
                             &position_,
                             &gradient_,
                             &cell_bounds_,
                             &corners_,
                             &support_,
                             &cavity_first_,
                             &cavity_slots_,
                             &item_slot_node_,
                             &item_slots_,
                             &cavity_gradient_})
    *buffer = cl::Buffer();
}

std::size_t Solid::scratch_bytes() const {
  const std::size_t real = real_bytes(scene_.precision);
  const auto n = [](int count) { return static_cast<std::size_t>(count); };
  const std::size_t nodes = n(mesh_.nodes);
  const std::size_t for_supports = nodes * 6 + n(members_) * n(scene_.parameters.size()) * real;
  const std::size_t for_fastest_mode =
      viscous_ || scene_.mechanics->quasi_static
          ? 0
          : (n(mesh_.cells) * 24 + nodes * 6 + nodes / SolidMesh::block * 3) * real;
  return for_supports + for_fastest_mode;
}

std::size_t Solid::bytes() const {
  std::size_t built = 0;
  for (const cl::Buffer& buffer : buffers())
    if (buffer() != nullptr) built += std::max(buffer.getInfo<CL_MEM_SIZE>(), Device::least_bytes);
  // What stands beside them for a while; a driver gives it back a little later.
  const auto members = static_cast<std::size_t>(members_), parts = static_cast<std::size_t>(voids_ + 1);
  const std::size_t for_mesh = members * static_cast<std::size_t>(grid_.size()) * (1 + 8 * parts);
  constexpr std::size_t small_buffers = 20 * Device::least_bytes;
  return std::max(built + scratch_bytes(), for_mesh) + small_buffers;
}

}  // namespace cohort
