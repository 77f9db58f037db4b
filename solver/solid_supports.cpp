// Clamps, springs and dashpots of the deforming tissue, and what they leave free.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/mechanics.hpp"
#include "solver/new_buffer.hpp"
#include "solver/on_all_cores.hpp"
#include "solver/precision.hpp"
#include "solver/solid.hpp"
#include "solver/solid_labels.hpp"
#include "solver/solid_voids.hpp"
#include "solver/solid_walls.hpp"

namespace cohort {

namespace {

using Matrix = std::array<double, 6>;  // xx yy zz yz xz xy
constexpr std::array<std::array<std::size_t, 2>, 6> entries = {
    {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};

/// Projects a symmetric matrix to Q A Q.
Matrix projected(const Matrix& Q, const Matrix& A) {
  const auto full = [](const Matrix& M) {
    return std::array<std::array<double, 3>, 3>{{{M[0], M[5], M[4]}, {M[5], M[1], M[3]}, {M[4], M[3], M[2]}}};
  };
  const auto q = full(Q), a = full(A);
  Matrix result{};
  for (std::size_t k = 0; k < 6; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) result[k] += q[entries[k][0]][i] * a[i][j] * q[j][entries[k][1]];
  return result;
}

/// A node and what resists its displacement, in some unit.
struct Held {
  int node;
  Matrix resists;
};

/// How many of the six rigid motions `held` leaves free.
int count_free_motions(const SolidMesh& mesh, const std::vector<Held>& held) {
  const auto nodes = static_cast<std::size_t>(mesh.nodes);
  std::array<double, 3> centre{};
  double radius = 0;
  const auto place = [&](const Held& one, std::size_t axis) {
    return mesh.position[axis * nodes + static_cast<std::size_t>(one.node)];
  };
  for (const Held& one : held)
    for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] += place(one, axis) / double(held.size());
  for (const Held& one : held)
    for (std::size_t axis = 0; axis < 3; ++axis)
      radius = std::max(radius, std::abs(place(one, axis) - centre[axis]));
  std::array<std::array<double, 6>, 6> stiffness{};
  for (const Held& one : held) {
    // Translations, then rotations about the axes by an angle of 1/radius.
    std::array<std::array<double, 3>, 6> motion{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      motion[k][k] = 1;
      motion[3 + k][j] = radius > 0 ? (place(one, i) - centre[i]) / radius : 0;
      motion[3 + k][i] = radius > 0 ? -(place(one, j) - centre[j]) / radius : 0;
    }
    for (std::size_t p = 0; p < 6; ++p)
      for (std::size_t q = 0; q < 6; ++q)
        for (std::size_t k = 0; k < 6; ++k) {
          const auto [i, j] = entries[k];
          stiffness[p][q] +=
              one.resists[k] * (i == j ? motion[p][i] * motion[q][i]
                                       : motion[p][i] * motion[q][j] + motion[p][j] * motion[q][i]);
        }
  }
  const std::array<double, 6> found = eigenvalues(stiffness);
  constexpr double nothing = 1e-6;
  return static_cast<int>(
      std::count_if(found.begin(), found.end(), [&](double x) { return !(x > nothing * found[5]); }));
}

}  // namespace

void Solid::build_supports(std::span<const Member> members) {
  struct Support {
    Matrix stiffness{}, dashpot{}, projector{1, 1, 1, 0, 0, 0};
  };
  std::vector<int> support_of(static_cast<std::size_t>(mesh_.nodes), -1);
  std::vector<Support> supports;
  const auto at = [&](int node) -> Support& {
    int& place = support_of[static_cast<std::size_t>(node)];
    if (place < 0) {
      place = static_cast<int>(supports.size());
      supports.emplace_back();
    }
    return supports[static_cast<std::size_t>(place)];
  };
  // Nodes near the void of a clamp are held.
  std::vector<cl_ushort> near(static_cast<std::size_t>(mesh_.nodes), 0);
  const cl::Buffer near_on_device = upload_new(launcher_, near, "near on device");
  const cl::Buffer vertex = upload_new(launcher_, mesh_.vertex, "vertex");
  std::vector<double> values;
  for (const Member& member : members)
    values.insert(values.end(), member.values.begin(), member.values.end());
  const cl::Buffer block = reals(values);
  if (labels_) {
    for (std::size_t a = 0; a < near.size(); ++a)
      if (mesh_.vertex[a] >= 0)
        near[a] = labels_->near[static_cast<std::size_t>(mesh_.vertex[a]) % labels_->near.size()];
  } else {
    launcher_(vertex_voids_, cl::NDRange(static_cast<std::size_t>(mesh_.nodes)),
              cl::NDRange(SolidMesh::block), 0.0, block, grid_.origin_and_spacing(), vertex, near_on_device);
    launcher_.queue().enqueueReadBuffer(near_on_device, CL_TRUE, 0, near.size() * sizeof(cl_ushort),
                                        near.data());
  }

  using Kind = Mechanics::Boundary::Kind;
  const auto& conditions = scene_.mechanics->boundary;
  std::vector<bool> reached(conditions.size() * members.size(), false);
  for (std::size_t b = 0; b < conditions.size(); ++b) {
    const bool normal = conditions[b].kind == Kind::clamp_normal || conditions[b].kind == Kind::spring_normal;
    const bool clamp = conditions[b].kind == Kind::clamp || conditions[b].kind == Kind::clamp_normal;
    const std::string path = "mechanics.boundary." + conditions[b].name;
    const int surface = void_of_surface(scene_, conditions[b].surface);
    const int stiffness = scene_.parameters.find(path + ".stiffness_kPa_per_mm"),
              dashpot = scene_.parameters.find(path + ".damping_kPa_ms_per_mm");
    for (const SolidMesh::Patch& patch : mesh_.surfaces[b]) {
      const double area = std::hypot(patch.area[0], patch.area[1], patch.area[2]);
      if (!(area > 0)) continue;
      const auto m =
          static_cast<std::size_t>(std::upper_bound(mesh_.node_blocks.begin(), mesh_.node_blocks.end(),
                                                    patch.node / SolidMesh::block) -
                                   mesh_.node_blocks.begin() - 1);
      Matrix direction{1, 1, 1, 0, 0, 0};
      if (normal)
        for (std::size_t k = 0; k < 6; ++k)
          direction[k] = patch.area[entries[k][0]] * patch.area[entries[k][1]] / (area * area);
      if (clamp) {
        if (!(near[static_cast<std::size_t>(patch.node)] >> surface & 1)) continue;
        mesh_.held[b].push_back(patch.node);
        reached[b * members.size() + m] = true;
        Support& support = at(patch.node);
        if (!normal) {
          support.projector = {0, 0, 0, 0, 0, 0};
          continue;
        }
        // Q - (Q n)(Q n) / (n Q n): also what several clamps leave.
        Matrix held = projected(support.projector, direction);
        const double trace = held[0] + held[1] + held[2];
        if (trace > 1e-6)
          for (std::size_t k = 0; k < 6; ++k) support.projector[k] -= held[k] / trace;
        continue;
      }
      reached[b * members.size() + m] = true;
      Support& support = at(patch.node);
      for (std::size_t k = 0; k < 6; ++k) {
        support.stiffness[k] += area * direction[k] * members[m].values[static_cast<std::size_t>(stiffness)];
        support.dashpot[k] += area * direction[k] * members[m].values[static_cast<std::size_t>(dashpot)];
      }
    }
  }
  for (std::size_t b = 0; b < conditions.size(); ++b)
    for (std::size_t m = 0; m < members.size(); ++m) {
      if (reached[b * members.size() + m] || !mesh_.defects[m].empty()) continue;
      const bool clamp = conditions[b].kind == Kind::clamp || conditions[b].kind == Kind::clamp_normal;
      mesh_.defects[m] = "mechanics.boundary." + conditions[b].name + ": the " +
                         (clamp ? "clamp" : "spring") + " holds nothing: surface \"" + conditions[b].surface +
                         "\" bounds no cell of the tissue";
    }
  free_motions_.assign(members.size(), 0);
  on_all_cores(members.size(), [&](std::size_t m) {
    // What resists: of clamps their directions, of springs their stiffness over the largest.
    double stiffest = 0;
    const auto of_member = [&](const auto& visit) {
      for (int a = mesh_.node_blocks[m] * SolidMesh::block; a < mesh_.node_blocks[m + 1] * SolidMesh::block;
           ++a)
        if (const int s = support_of[static_cast<std::size_t>(a)]; s >= 0)
          visit(a, supports[static_cast<std::size_t>(s)]);
    };
    of_member([&](int, const Support& s) {
      stiffest = std::max(stiffest, s.stiffness[0] + s.stiffness[1] + s.stiffness[2]);
    });
    std::vector<Held> held;
    of_member([&](int node, const Support& s) {
      Held one{node, s.projector};
      for (std::size_t k = 0; k < 6; ++k)
        one.resists[k] = (k < 3 ? 1 : 0) - one.resists[k] + (stiffest > 0 ? s.stiffness[k] / stiffest : 0);
      held.push_back(one);
    });
    free_motions_[m] = count_free_motions(mesh_, held);
  });
  // In the order of nodes.
  std::vector<Support> sorted;
  for (int& place : support_of)
    if (place >= 0) {
      sorted.push_back(supports[static_cast<std::size_t>(place)]);
      place = static_cast<int>(sorted.size()) - 1;
    }
  supports = std::move(sorted);
  supports_ = std::max<int>(1, static_cast<int>(supports.size()));
  std::vector<double> fields(18 * static_cast<std::size_t>(supports_), 0);
  for (std::size_t s = 0; s < supports.size(); ++s) {
    const bool clamped = supports[s].projector != Support{}.projector;
    const auto left = [&](const Matrix& A) { return clamped ? projected(supports[s].projector, A) : A; };
    const Matrix stiffness = left(supports[s].stiffness), dashpot = left(supports[s].dashpot);
    for (std::size_t k = 0; k < 6; ++k) {
      fields[k * static_cast<std::size_t>(supports_) + s] = stiffness[k];
      fields[(6 + k) * static_cast<std::size_t>(supports_) + s] = dashpot[k];
      fields[(12 + k) * static_cast<std::size_t>(supports_) + s] = supports[s].projector[k];
    }
  }
  constexpr int clamped = 1 << 30;  // as CLAMPED in kernels/solid_nodes.cl
  for (int& place : support_of)
    if (place >= 0 && supports[static_cast<std::size_t>(place)].projector != Support{}.projector)
      place |= clamped;
  support_of_ = upload_new(launcher_, support_of, "support of");
  support_ = reals(fields);
}

}  // namespace cohort
