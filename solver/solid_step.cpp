// The launches of a step, and what bounds it.
#include <algorithm>
#include <cmath>

#include "solver/lumped_circulation.hpp"
#include "solver/precision.hpp"
#include "solver/solid.hpp"

namespace cohort {

namespace {

constexpr double courant = 0.95;
constexpr int mode_iterations = 150;  // of the fastest mode, from a start without order

}  // namespace

void Solid::forces(const cl::Buffer& parameters) {
  const auto cells = static_cast<std::size_t>(mesh_.cells);
  const std::size_t items = scene_.mechanics->cavities.empty() ? 0 : static_cast<std::size_t>(mesh_.items);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  const bool gpu = launcher_.device().info().gpu;
  const auto slots = static_cast<std::size_t>(mesh_.slot_node.size());
  const std::size_t size = gpu ? cells + items : (cells + items) / SolidMesh::block;
  launcher_(forces_, cl::NDRange(size), cl::NDRange(gpu ? SolidMesh::block : 1),
            static_cast<double>(cells) * (17 + real * (4 + 12 + 1 + tension_states_ + 4)) +
                static_cast<double>(slots) * (4 + real * 6) +
                static_cast<double>(items) * (9 + 16 + real * (4 + 6 + 3)) +
                static_cast<double>(mesh_.item_slot_node.size()) * (4 + real * 6),
            parameters, state_, member_of_cell_, cell_nodes_, tile_slots_, slot_node_, cell_slots_, share_,
            region_, direction_, activation_, tension_, u_, v_, force_, pulls_, member_of_item_, item_cell_,
            item_cavity_, item_share_, item_faces_, item_tile_slots_, item_slot_node_, item_slots_, position_,
            lid_, gradient_, volume_, cl::Local(gpu ? bytes_of_tile() : 8), mesh_.cells, mesh_.nodes,
            static_cast<int>(slots), static_cast<int>(mesh_.item_slot_node.size()), mesh_.most_slots,
            Real{grid_.dx_mm}, odd_, drive_, drive_column_, drive_clock_);
}

void Solid::predict(bool measured) {
  const bool gpu = launcher_.device().info().gpu;
  const auto nodes = static_cast<std::size_t>(mesh_.nodes);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(predict_, cl::NDRange(gpu ? nodes : nodes / SolidMesh::block),
            cl::NDRange(gpu ? SolidMesh::block : 1),
            static_cast<double>(nodes) * (8 + real * (1 + 6)) +
                static_cast<double>(mesh_.slot_node.size() + mesh_.item_slot_node.size()) * (4 + real * 3),
            state_, member_of_node_, first_slot_, node_slots_, inverse_mass_, support_of_, support_,
            cavity_block_, cavity_of_, cavity_first_, cavity_slots_, force_, gradient_, cavity_gradient_, u_,
            v_, node_sums_, static_cast<int>(mesh_.slot_node.size()), mesh_.nodes, supports_,
            static_cast<int>(mesh_.item_slot_node.size()), mesh_.cavity_nodes, odd_, measured ? 1 : 0);
}

void Solid::load(bool measured) {
  const bool gpu = launcher_.device().info().gpu;
  const auto groups = static_cast<std::size_t>(members_);
  launcher_(member_, cl::NDRange(gpu ? groups * member_group : groups), cl::NDRange(gpu ? member_group : 1),
            0.0, parameters_, node_sums_, speeds_, measures_, dashpots_, volume_, pulls_, node_blocks_,
            cell_blocks_, item_blocks_, pressures_, loads_, state_, series_, static_cast<int>(samples_),
            Real{samples_ > 0 ? 1000 / scene_.parameters.value("outputs.pv.rate_hz") : 0},
            mesh_.nodes / SolidMesh::block, mesh_.cells / SolidMesh::block, measured ? 1 : 0,
            Real{grid_.dx_mm}, Real{courant}, odd_);
}

void Solid::beat(const cl::Buffer& parameters, const LumpedCirculation& circulation, int samples,
                 bool sampled, bool measured) {
  const bool gpu = launcher_.device().info().gpu;
  const auto groups = static_cast<std::size_t>(members_);
  launcher_(member_, cl::NDRange(gpu ? groups * member_group : groups), cl::NDRange(gpu ? member_group : 1),
            0.0, parameters, node_sums_, speeds_, measures_, dashpots_, volume_, node_blocks_, cell_blocks_,
            item_blocks_, cavity_ends_, inflation_, damping_, state_, circulation.states(),
            circulation.statuses(), circulation.clock(), circulation.pressure_buffer(),
            circulation.volume_buffer(), circulation.at_most(), samples, mesh_.nodes / SolidMesh::block,
            mesh_.cells / SolidMesh::block, sampled ? 1 : 0, measured ? 1 : 0, Real{grid_.dx_mm},
            Real{courant}, odd_);
}

void Solid::move() {
  const auto nodes = static_cast<std::size_t>(moving_blocks_ * SolidMesh::block);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(move_, cl::NDRange(nodes), cl::NDRange(SolidMesh::block), static_cast<double>(nodes) * real * 10,
            moving_, state_, member_of_node_, inverse_mass_, support_of_, support_, cavity_block_, cavity_of_,
            cavity_gradient_, u_, v_, mesh_.nodes, supports_, mesh_.cavity_nodes, odd_);
  odd_ = 1 - odd_;
}

void Solid::find_fastest_mode(const cl::Buffer& parameters) {
  const bool gpu = launcher_.device().info().gpu;
  const auto cells = static_cast<std::size_t>(mesh_.cells), nodes = static_cast<std::size_t>(mesh_.nodes),
             members = static_cast<std::size_t>(members_);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  const cl::Buffer wave = zeros(6 * nodes);
  const cl::Buffer sums = zeros(3 * nodes / SolidMesh::block);
  const cl::Buffer force = zeros(24 * cells);
  launcher_(wave_start_, cl::NDRange(nodes), cl::NDRange(SolidMesh::block), 0.0, member_of_node_,
            node_blocks_, state_, wave, mesh_.nodes);
  for (int k = 0; k < mode_iterations; ++k) {
    launcher_(wave_cells_, cl::NDRange(cells), cl::NDRange(SolidMesh::block),
              static_cast<double>(cells) * (33 + real * (4 + 12 + 24 + 3)), parameters, state_,
              member_of_cell_, cell_nodes_, share_, region_, direction_, tension_, u_, wave, force,
              mesh_.cells, mesh_.nodes, Real{grid_.dx_mm});
    launcher_(wave_nodes_, cl::NDRange(gpu ? nodes : nodes / SolidMesh::block),
              cl::NDRange(gpu ? SolidMesh::block : 1),
              static_cast<double>(nodes) * (40 + real * (24 + 1 + 6)), state_, member_of_node_, corners_,
              inverse_mass_, support_of_, support_, force, wave, sums, mesh_.cells, mesh_.nodes, supports_);
    launcher_(wave_member_, cl::NDRange(gpu ? members * member_group : members),
              cl::NDRange(gpu ? member_group : 1), 0.0, parameters, sums, node_blocks_, state_,
              mesh_.nodes / SolidMesh::block, Real{grid_.dx_mm});
  }
}

void Solid::measure(const cl::Buffer& parameters) {
  const bool gpu = launcher_.device().info().gpu;
  const auto cells = static_cast<std::size_t>(mesh_.cells), nodes = static_cast<std::size_t>(mesh_.nodes);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(measure_, cl::NDRange(gpu ? cells : cells / SolidMesh::block),
            cl::NDRange(gpu ? SolidMesh::block : 1), static_cast<double>(cells) * (33 + real * 20),
            parameters, state_, member_of_cell_, cell_nodes_, share_, region_, direction_, tension_, u_, v_,
            cell_bounds_, measures_, mesh_.cells, mesh_.nodes, Real{grid_.dx_mm});
  launcher_(bound_, cl::NDRange(gpu ? nodes : nodes / SolidMesh::block),
            cl::NDRange(gpu ? SolidMesh::block : 1), static_cast<double>(nodes) * (32 + real * 9), state_,
            member_of_node_, corners_, inverse_mass_, cell_bounds_, speeds_, mesh_.nodes);
  if (balances_)
    launcher_(find_dashpots_, cl::NDRange(gpu ? nodes : nodes / SolidMesh::block),
              cl::NDRange(gpu ? SolidMesh::block : 1), static_cast<double>(nodes) * 4, state_,
              member_of_node_, support_of_, support_, v_, dashpots_, mesh_.nodes, supports_);
}

double Solid::first_step_ms(const cl::Buffer& parameters) {
  measure(parameters);
  const std::vector<double> found = read(speeds_, static_cast<std::size_t>(mesh_.nodes / SolidMesh::block));
  return courant * grid_.dx_mm / std::sqrt(*std::max_element(found.begin(), found.end()));
}

}  // namespace cohort
