// Places of the deforming tissue: of cells, of points within them, of what went wrong.
#include <cmath>
#include <sstream>

#include "solver/solid.hpp"

namespace cohort {

std::array<double, 3> Solid::centre(std::size_t cell) const {
  const std::int64_t at = mesh_.grid_cell[cell] % grid_.size();
  const auto& [nx, ny, nz] = grid_.cells;
  const std::array<std::int64_t, 3> index = {at % nx, at / nx % ny, at / (std::int64_t{nx} * ny)};
  std::array<double, 3> result{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    result[axis] = grid_.origin_mm[axis] + grid_.dx_mm * (static_cast<double>(index[axis]) + 0.5);
  return result;
}

std::pair<std::size_t, double> Solid::worst_cell(std::size_t k) {
  // The member's nodes alone: a batch is long.
  const auto nodes = static_cast<std::size_t>(mesh_.nodes);
  const auto first = static_cast<std::size_t>(mesh_.node_blocks[k] * SolidMesh::block),
             count = static_cast<std::size_t>(mesh_.node_blocks[k + 1] * SolidMesh::block) - first;
  std::array<std::vector<double>, 3> u, v;
  for (std::size_t row = 0; row < 3; ++row) {
    u[row] = read(u_, count, row * nodes + first);
    v[row] = read(v_, count, row * nodes + first);
  }
  double worst = 1e30;
  std::size_t where = 0;
  for (int i = mesh_.cell_blocks[k] * SolidMesh::block; i < mesh_.cell_blocks[k + 1] * SolidMesh::block;
       ++i) {
    const auto cell = static_cast<std::size_t>(i);
    if (mesh_.grid_cell[cell] < 0) continue;
    // Volume of the cell by its edges' means.
    std::array<std::array<double, 3>, 3> F{};
    double speeds = 0;  // no number where a velocity is none: displacements follow a step later
    for (int corner = 0; corner < 8; ++corner) {
      const auto node =
          static_cast<std::size_t>(
              mesh_.cell_nodes[static_cast<std::size_t>(corner) * static_cast<std::size_t>(mesh_.cells) +
                               cell]) -
          first;
      for (std::size_t row = 0; row < 3; ++row) {
        speeds += v[row][node];
        for (std::size_t axis = 0; axis < 3; ++axis)
          F[row][axis] += (corner >> axis & 1 ? 0.25 : -0.25) / grid_.dx_mm * u[row][node];
      }
    }
    for (std::size_t row = 0; row < 3; ++row) F[row][row] += 1;
    const double J = F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) -
                     F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
                     F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
    if (!std::isfinite(J) || !std::isfinite(speeds)) return {cell, std::numeric_limits<double>::quiet_NaN()};
    if (J < worst) {
      worst = J;
      where = cell;
    }
  }
  return {where, worst};
}

std::size_t Solid::fastest_node(std::size_t k) {
  const auto nodes = static_cast<std::size_t>(mesh_.nodes);
  const std::vector<double> bound = read(cell_bounds_, static_cast<std::size_t>(mesh_.cells));
  double fastest = -1;
  std::size_t where = 0;
  for (auto a = static_cast<std::size_t>(mesh_.node_blocks[k] * SolidMesh::block);
       a < static_cast<std::size_t>(mesh_.node_blocks[k + 1] * SolidMesh::block); ++a) {
    if (!(mesh_.inverse_mass[a] > 0)) continue;
    double met = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      const double of_cell = bound[static_cast<std::size_t>(mesh_.corners[a + c * nodes])];
      met = viscous_ ? std::max(met, of_cell) : met + of_cell * mesh_.inverse_mass[a];
    }
    if (met <= fastest) continue;
    fastest = met;
    where = a;
  }
  return where;
}

std::string Solid::overstepped(std::size_t k) {
  const std::vector<double> all = state();
  const std::span<const double> S = std::span(all).subspan(k * state_size, state_size);
  const double bound = grid_.dx_mm / std::sqrt(S[largest_speed2]);
  const std::size_t node = fastest_node(k), nodes = static_cast<std::size_t>(mesh_.nodes);
  std::ostringstream text;
  text.precision(3);
  text << "the tissue's step of " << S[step_share] * bound << " ms is beyond the limit of " << bound
       << " ms, by waves at (" << mesh_.position[node] << ", " << mesh_.position[node + nodes] << ", "
       << mesh_.position[node + 2 * nodes] << ") mm, region ";
  for (std::size_t c = 0; c < 8; ++c)
    if (const auto cell = static_cast<std::size_t>(mesh_.corners[node + c * nodes]);
        mesh_.grid_cell[cell] >= 0) {
      text << scene_.regions[mesh_.region[cell]].name;
      break;
    }
  return text.str();
}

std::string Solid::failure(std::size_t k, SolidEnd end) {
  if (end == SolidEnd::overstepped) return overstepped(k);
  const auto [where, worst] = worst_cell(k);
  const std::array<double, 3> X = centre(where);
  std::ostringstream text;
  text.precision(3);
  switch (end) {
    case SolidEnd::inverted:
      text << "a cell of the tissue is inverted";
      break;
    case SolidEnd::runaway:
      text << "the tissue runs away: its energy is no number";
      break;
    case SolidEnd::stiff:
      text << "the tissue collapses: its waves ask for steps of less than 2 % of the first";
      break;
    case SolidEnd::unsettled:
      text << "the tissue comes to no rest under its loads";
      break;
    case SolidEnd::overstepped:
    case SolidEnd::moves:
    case SolidEnd::settled:
      break;
  }
  text << "; smallest volume ratio " << worst << " at (" << X[0] << ", " << X[1] << ", " << X[2]
       << ") mm, region " << scene_.regions[mesh_.region[where]].name;
  return text.str();
}

Solid::Place Solid::place_of(std::size_t m, const std::array<double, 3>& X) const {
  const double h = grid_.dx_mm;
  double nearest = 1e30;
  int cell = -1;
  std::array<double, 3> inside{};
  for (int i = mesh_.cell_blocks[m] * SolidMesh::block; i < mesh_.cell_blocks[m + 1] * SolidMesh::block;
       ++i) {
    if (mesh_.grid_cell[static_cast<std::size_t>(i)] < 0) continue;
    const auto first = static_cast<std::size_t>(mesh_.cell_nodes[static_cast<std::size_t>(i)]);
    std::array<double, 3> at{};
    double distance = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at[axis] = (X[axis] - mesh_.position[axis * static_cast<std::size_t>(mesh_.nodes) + first]) / h;
      distance = std::max(distance, std::abs(at[axis] - 0.5));
    }
    if (distance < nearest) {
      nearest = distance;
      cell = i;
      inside = at;
    }
  }
  Place place;
  place.beyond_mm = std::max(0.0, nearest - 0.5) * h;
  for (std::size_t c = 0; c < 8 && cell >= 0; ++c) {
    place.nodes[c] =
        mesh_.cell_nodes[c * static_cast<std::size_t>(mesh_.cells) + static_cast<std::size_t>(cell)];
    place.weights[c] = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
      place.weights[c] *= c >> axis & 1 ? inside[axis] : 1 - inside[axis];
  }
  return place;
}

std::array<double, 3> Solid::displacement_at(std::size_t m, const std::array<double, 3>& X,
                                             const std::vector<double>& displacement) const {
  const Place place = place_of(m, X);
  std::array<double, 3> result{};
  for (std::size_t c = 0; c < 8; ++c)
    for (std::size_t axis = 0; axis < 3; ++axis)
      result[axis] += place.weights[c] * displacement[axis * static_cast<std::size_t>(mesh_.nodes) +
                                                      static_cast<std::size_t>(place.nodes[c])];
  return result;
}

}  // namespace cohort
