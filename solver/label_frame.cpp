// The heart's frame, and the blood that tags of meshes leave out, from the voxels themselves.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/labels.hpp"

namespace cohort {

namespace {

using Vector = std::array<double, 3>;

Vector minus(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector along(const Vector& a, double s, const Vector& direction) {
  return {a[0] + s * direction[0], a[1] + s * direction[1], a[2] + s * direction[2]};
}
Vector unit(Vector a, const char* what) {
  const double length = std::sqrt(dot(a, a));
  if (!(length > 1e-6))
    throw std::invalid_argument(std::string("no frame of the heart can be found: ") + what);
  for (double& x : a) x /= length;
  return a;
}

/// Calls visit(voxel, x, y, z) for all voxels.
template <class Visit>
void each_voxel(const LabelImage& image, Visit visit) {
  std::size_t voxel = 0;
  for (int z = 0; z < image.cells[2]; ++z)
    for (int y = 0; y < image.cells[1]; ++y)
      for (int x = 0; x < image.cells[0]; ++x) visit(voxel++, x, y, z);
}

/// Calls visit(neighbour) for the six neighbours of a voxel; -1 beyond the image.
template <class Visit>
void each_neighbour(const LabelImage& image, std::size_t voxel, int x, int y, int z, Visit visit) {
  const auto [nx, ny, nz] = image.cells;
  const auto v = static_cast<std::int64_t>(voxel), row = std::int64_t{nx}, layer = row * ny;
  visit(x > 0 ? v - 1 : -1);
  visit(x + 1 < nx ? v + 1 : -1);
  visit(y > 0 ? v - row : -1);
  visit(y + 1 < ny ? v + row : -1);
  visit(z > 0 ? v - layer : -1);
  visit(z + 1 < nz ? v + layer : -1);
}

}  // namespace

Affine heart_frame(const LabelImage& image, const std::vector<Part>& part_of_label, int rv_part) {
  const auto part = [&](std::int64_t v) {
    return v < 0 ? no_part : part_of_label[image.voxels[static_cast<size_t>(v)]];
  };
  const bool atrium =
      std::any_of(part_of_label.begin(), part_of_label.end(), [](Part p) { return p == la_blood_part; });
  Mean blood, right, right_wall, contact_with_atrium, open;
  each_voxel(image, [&](std::size_t v, int x, int y, int z) {
    const Part p = part_of_label[image.voxels[v]];
    const bool wall = rv_part >= 0 && p == rv_part;
    if (p != lv_blood_part && p != rv_blood_part && !wall) return;
    const Vector place = image.to_world({double(x), double(y), double(z)});
    if (p == rv_blood_part) right.add(place);
    if (wall) right_wall.add(place);
    if (p != lv_blood_part) return;
    blood.add(place);
    each_neighbour(image, v, x, y, z, [&](std::int64_t n) {
      const Part q = part(n);
      if (q == la_blood_part) contact_with_atrium.add(place);
      if (q == no_part || (q > rv_blood_part && q < first_region_part)) open.add(place);
    });
  });
  const char* sides = "it needs the blood of the left ventricle, and the right ventricle";
  if (blood.count == 0 || (right.count == 0 && right_wall.count == 0))
    throw std::invalid_argument(std::string("no frame of the heart can be found: ") + sides);
  const Mean& contact = atrium && contact_with_atrium.count > 0 ? contact_with_atrium : open;
  if (contact.count == 0)
    throw std::invalid_argument(
        "no frame of the heart can be found: the left ventricle's blood is closed on all sides");

  const Vector mitral = contact.value(), centroid = blood.value();
  double farthest = 0;
  each_voxel(image, [&](std::size_t v, int x, int y, int z) {
    if (part_of_label[image.voxels[v]] != lv_blood_part) return;
    const Vector d = minus(image.to_world({double(x), double(y), double(z)}), mitral);
    farthest = std::max(farthest, dot(d, d));
  });
  // The mean of what lies within 5 % of the farthest: one voxel would tilt the axis.
  Mean apex;
  each_voxel(image, [&](std::size_t v, int x, int y, int z) {
    if (part_of_label[image.voxels[v]] != lv_blood_part) return;
    const Vector place = image.to_world({double(x), double(y), double(z)}), d = minus(place, mitral);
    if (dot(d, d) >= 0.95 * 0.95 * farthest) apex.add(place);
  });
  const Vector up = unit(minus(centroid, apex.value()), "the left ventricle's blood is a point");
  const Vector origin = along(centroid, dot(minus(mitral, centroid), up), up);
  Vector across = minus((right.count > 0 ? right : right_wall).value(), origin);
  across = unit(along(across, -dot(across, up), up), "the right ventricle lies on the left one's axis");
  const Vector front = cross(up, across);
  Affine frame;
  const Vector axes[] = {across, front, up};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) frame.row[i][j] = axes[i][j];
    frame.row[i][3] = -dot(axes[i], origin);
  }
  return frame;
}

LabelImage with_enclosed_blood(LabelImage image, LabelTable& table) {
  const auto names = [&](const std::string& name) {
    return std::any_of(table.begin(), table.end(), [&](const auto& entry) { return entry.second == name; });
  };
  if (!names("lv") || std::any_of(std::begin(blood_names), std::end(blood_names), names)) return image;

  const char* chambers[] = {"lv", "rv", "la", "ra"};
  std::vector<int> chamber_of(image.labels.size(), -1);
  std::vector<bool> open(image.labels.size(), false);
  for (std::size_t i = 0; i < image.labels.size(); ++i) {
    const auto it = table.find(image.labels[i]);
    if (it == table.end()) continue;
    open[i] = it->second == "background";
    for (int c = 0; c < 4; ++c)
      if (it->second == chambers[c]) chamber_of[i] = c;
  }
  const double mL = std::abs(determinant(image.to_world)) / 1000;
  std::vector<bool> seen(image.size(), false);
  std::array<std::vector<std::size_t>, 4> pools;
  const auto [nx, ny, nz] = image.cells;
  std::vector<std::size_t> pool;
  for (std::size_t seed = 0; seed < seen.size(); ++seed) {
    if (seen[seed] || !open[image.voxels[seed]]) continue;
    pool.assign(1, seed);
    seen[seed] = true;
    bool enclosed = true;
    std::array<std::int64_t, 4> faces{};
    for (std::size_t k = 0; k < pool.size(); ++k) {
      const std::size_t v = pool[k], row = v / size_t(nx);
      each_neighbour(image, v, int(v % size_t(nx)), int(row % size_t(ny)), int(row / size_t(ny)),
                     [&](std::int64_t n) {
                       if (n < 0) {
                         enclosed = false;
                         return;
                       }
                       const auto next = static_cast<std::size_t>(n);
                       const int chamber = chamber_of[image.voxels[next]];
                       if (chamber >= 0) ++faces[size_t(chamber)];
                       if (seen[next] || !open[image.voxels[next]]) return;
                       seen[next] = true;
                       pool.push_back(next);
                     });
    }
    if (!enclosed || static_cast<double>(pool.size()) * mL < 1) continue;
    const std::int64_t all = faces[0] + faces[1] + faces[2] + faces[3];
    const std::size_t most = size_t(std::max_element(faces.begin() + 1, faces.end()) - faces.begin());
    const std::size_t chamber = 4 * faces[most] > all ? most : 0;
    pools[chamber].insert(pools[chamber].end(), pool.begin(), pool.end());
  }
  std::int32_t value = std::min(table.begin()->first, image.labels.front()) - 1;
  for (std::size_t c = 0; c < 4; ++c) {
    if (pools[c].empty() || image.labels.size() > 255) continue;
    const auto place = static_cast<std::uint8_t>(image.labels.size());
    for (const std::size_t v : pools[c]) {
      --image.counts[image.voxels[v]];
      image.voxels[v] = place;
    }
    image.labels.push_back(value);
    image.counts.push_back(static_cast<std::int64_t>(pools[c].size()));
    table[value--] = blood_names[c];
  }
  return image;
}

}  // namespace cohort
