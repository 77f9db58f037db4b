#include "solver/plan_memory.hpp"

#include <algorithm>
#include <functional>

#include "solver/precision.hpp"

namespace cohort {

namespace {

/// Places of the members' tissue, built one after the other: the most of one, and all.
struct Places {
  std::int64_t largest = 0, all = 0;
};
Places places_of(Launcher& launcher, const Scene& scene, const Grid& grid, std::span<const Member> members) {
  Places result;
  Tissue tissue(launcher, scene, grid, 1);
  for (const Member& member : members) {
    const std::vector<std::byte> packed = pack(member.values, scene.precision);
    const cl::Buffer parameters = launcher.device().allocate(packed.size(), "parameters");
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    tissue.build(parameters, 1);
    result.largest = std::max(result.largest, static_cast<std::int64_t>(tissue.stride));
    result.all += tissue.stride;
  }
  return result;
}

}  // namespace

std::vector<Member> largest_members(const Scene& scene, std::span<const Member> members) {
  constexpr std::size_t most = 4;  // each is built once
  // It need not be the scene's own heart.
  if (members.size() == 1) return {members.begin(), members.end()};
  struct Length {
    std::size_t place;
    double lower, upper;
    double spread() const { return (upper - lower) / std::max(std::abs(upper), 1.0); }
  };
  std::vector<Length> lengths;
  for (int k = 0; k < scene.parameters.size(); ++k) {
    const Parameter& parameter = scene.parameters[k];
    if (!parameter.path.starts_with("geometry.") || parameter.unit != "mm" || members.empty()) continue;
    Length length{static_cast<std::size_t>(k), 1e30, -1e30};
    for (const Member& member : members) {
      length.lower = std::min(length.lower, member.values[length.place]);
      length.upper = std::max(length.upper, member.values[length.place]);
    }
    if (length.upper > length.lower) lengths.push_back(length);
  }
  std::stable_sort(lengths.begin(), lengths.end(),
                   [](const Length& a, const Length& b) { return a.spread() > b.spread(); });
  std::vector<Member> result;
  const auto add_largest = [&](const std::function<double(const Member&)>& size) {
    const auto largest = std::max_element(
        members.begin(), members.end(), [&](const Member& a, const Member& b) { return size(a) < size(b); });
    const bool known = std::any_of(result.begin(), result.end(),
                                   [&](const Member& member) { return member.id == largest->id; });
    if (!known && result.size() < most) result.push_back(*largest);
  };
  if (!lengths.empty())
    add_largest([&](const Member& member) {
      double sum = 0;
      for (const Length& length : lengths)
        sum += length.spread() * (member.values[length.place] - length.lower) / (length.upper - length.lower);
      return sum;
    });
  for (const Length& length : lengths)
    add_largest([&](const Member& member) { return member.values[length.place]; });
  return result;
}

std::int64_t places_of_batch(Launcher& launcher, const Scene& scene, const Grid& grid,
                             std::span<const Member> members, int batch, std::int64_t least) {
  constexpr int alike = 8;
  const std::vector<Member> large = largest_members(scene, members);
  if (large.empty()) return least * batch;
  if (batch >= alike)
    return places_of(launcher, scene, grid, members.first(static_cast<std::size_t>(batch))).all;
  return std::max(least, places_of(launcher, scene, grid, large).largest) * batch;
}

}  // namespace cohort
