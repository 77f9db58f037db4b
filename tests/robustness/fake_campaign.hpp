#pragma once

#include <chrono>
#include <cmath>
#include <thread>

#include "ensemble/members.hpp"
#include "ensemble/schema.hpp"
#include "ensemble/worker.hpp"

namespace cohort::fake {

/// A campaign of three parameters, two of them sampled, without a scene behind it.
inline Campaign campaign(std::int64_t members, std::uint64_t seed = 7) {
  Campaign c;
  auto& table = c.scene.parameters;
  table.add({.path = "geometry.heart.lv_wall_mm",
             .unit = "mm",
             .value = 10,
             .lower = 5,
             .upper = 20,
             .meaning = "",
             .source = ""});
  table.add({.path = "electrophysiology.sigma_mS_per_mm",
             .unit = "mS/mm",
             .value = 0.1,
             .lower = 0.01,
             .upper = 1,
             .meaning = "",
             .source = ""});
  table.add({.path = "torso.radius_mm",
             .unit = "mm",
             .value = 150,
             .lower = 100,
             .upper = 200,
             .meaning = "",
             .source = ""});
  c.parameters = {
      {"geometry.heart.lv_wall_mm",
       {.kind = Distribution::Kind::normal, .a = 10, .b = 1, .lower = 7, .upper = 14, .choices = {}}},
      {"electrophysiology.sigma_mS_per_mm",
       {.kind = Distribution::Kind::log_uniform, .a = 0.05, .b = 0.5, .choices = {}}}};
  c.members = members;
  c.seed = seed;
  c.check_fraction = 0.1;
  c.text = "campaign: {members: " + std::to_string(members) + ", seed: " + std::to_string(seed) + "}\n";
  c.sha256 = "sha256-of-" + std::to_string(members) + "-" + std::to_string(seed);
  return c;
}

inline Layout layout(std::size_t samples = 200) {
  Layout l;
  l.leads = {"I", "II", "III", "aVR", "aVL", "aVF", "V1", "V2", "V3", "V4", "V5", "V6"};
  for (std::size_t i = 0; i < samples; ++i) l.ecg_ms.push_back(static_cast<double>(i));
  l.compartments = {"LV", "aorta"};
  for (int i = 0; i < 20; ++i) l.pv_ms.push_back(2 * i);
  l.points = {"apex"};
  l.displacement_ms = {0, 10, 20};
  l.features = {"qrs_ms", "qt_ms"};
  l.feature_units = {"ms", "ms"};
  return l;
}

/// Numbers that are a function of the member's values, another for each `kind` of series.
inline std::vector<float> series(const Member& member, std::size_t count, double kind) {
  std::vector<float> numbers;
  for (std::size_t i = 0; i < count; ++i)
    numbers.push_back(static_cast<float>(member.values[0] * kind + std::sqrt(static_cast<double>(i))));
  return numbers;
}

/// An "ECG" that is a function of the member's values; members 5, 11 and 17 end badly.
inline Recording simulate(const Member& member, const Layout& layout) {
  Recording r;
  r.dt_ms = 0.05;
  r.dx_mm = 2;
  if (member.id == 5 || member.id == 11 || member.id == 17) {
    r.outcome = member.id == 5 ? Outcome::unstable : member.id == 11 ? Outcome::rejected : Outcome::failed;
    r.reason = "made to fail: member " + std::to_string(member.id);
    r.failed_at_ms = 3.5;
    return r;
  }
  r.outcome = Outcome::done;
  for (std::size_t lead = 0; lead < layout.leads.size(); ++lead)
    for (const double t : layout.ecg_ms)
      r.ecg.push_back(static_cast<float>(std::sin(member.values[0] * 0.01 * t + static_cast<double>(lead)) *
                                         member.values[1]));
  r.pressure = series(member, layout.compartments.size() * layout.pv_ms.size(), 2);
  r.volume = series(member, layout.compartments.size() * layout.pv_ms.size(), 3);
  r.displacement = series(member, layout.points.size() * 3 * layout.displacement_ms.size(), 4);
  r.features = {static_cast<float>(member.values[0]), static_cast<float>(member.values[1])};
  return r;
}

/// At half the spacing: the same members with features that differ by an error that grows with the first
/// value.
inline Recording simulate_fine(const Member& member, const Layout& layout) {
  Recording r = simulate(member, layout);
  r.dt_ms /= 2;
  r.dx_mm /= 2;
  if (r.outcome == Outcome::done) r.features[0] -= static_cast<float>(0.01 * member.values[0]);
  return r;
}

/// Runs a batch as the fake simulator does, taking `per_batch`.
inline RunBatch run(const Layout& layout, std::chrono::milliseconds per_batch = {},
                    Recording (*simulator)(const Member&, const Layout&) = simulate) {
  return [=](std::span<const Member> members, double) {
    std::this_thread::sleep_for(per_batch);
    std::vector<Recording> recordings;
    for (const auto& member : members) recordings.push_back(simulator(member, layout));
    return recordings;
  };
}

}  // namespace cohort::fake
