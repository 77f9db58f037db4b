// The conduction system on a coarse heart: sites, fast layer, delay, path.
#include <cmath>
#include <numbers>
#include <set>

#include "tests/coarse_heart.hpp"

namespace cohort::test {
namespace {

TEST(ConductionSystem, SitesAreTheNearestCellsOfTheirSurface) {
  using Surface = ConductionSystem::Surface;
  Scene scene = coarse_heart();
  // The normal ones, and many more: cells lie in planes of one height, and most sites find their cell in the
  // nearest plane whatever the distances around the axis.
  const std::size_t normal = scene.conduction_system->early_sites.size();
  const Surface surfaces[] = {Surface::lv, Surface::rv_septum, Surface::rv_free_wall};
  constexpr int more = 60;
  for (int n = 0; n < more; ++n)
    scene.conduction_system->early_sites.push_back({"site" + std::to_string(n), surfaces[n % 3]});
  declare(scene, 4);
  const std::string sites = "electrophysiology.conduction_system.early_sites.";
  Changes changes;
  for (int n = 0; n < more; ++n) {
    const std::string site = sites + "site" + std::to_string(n);
    changes.emplace_back(site + ".height", 0.2 + 0.6 * n / more);
    changes.emplace_back(site + ".angle_deg", (n * 67) % 360 - 180);
  }
  Parts heart(scene, changes);
  const auto sheet = heart.read<std::uint8_t>(heart.activation.network().sheet().id, 1);
  const std::vector<Eikonal::Source>& sources = heart.activation.network().sources();
  ASSERT_EQ(sources.size(), 1 + scene.conduction_system->early_sites.size());
  std::set<int> cells;
  for (size_t k = 1; k < sources.size(); ++k) {
    const auto& site = scene.conduction_system->early_sites[k - 1];
    const auto value = [&](const char* name) {
      return heart.one.values[static_cast<size_t>(scene.parameters.index(sites + site.name + "." + name))];
    };
    const std::size_t found = static_cast<size_t>(sources[k].cell);
    const auto distance = [&](std::size_t i) {
      const std::array<double, 3> p = heart.tissue.centre(i);
      const double up = (heart.coordinate(1, i) - value("height")) * 90;
      const double turn = heart.coordinate(2, i) - value("angle_deg") * std::numbers::pi / 180;
      return std::hypot(up, std::hypot(p[0], p[1]) * std::remainder(turn, 2 * std::numbers::pi),
                        heart.coordinate(3, i));
    };
    const auto on_surface = [&](std::size_t i) {
      const std::string& region = scene.regions[heart.tissue.regions[i]].name;
      if (site.surface == Surface::lv) return sheet[i] == 1;
      return sheet[i] == 2 && region == (site.surface == Surface::rv_septum ? "lv" : "rv");
    };
    double least = 1e9;
    for (std::size_t i = 0; i < sheet.size(); ++i)
      if (heart.tissue.regions[i] != 255 && on_surface(i)) least = std::min(least, distance(i));
    EXPECT_TRUE(on_surface(found)) << site.name;
    EXPECT_NEAR(distance(found), least, 1e-3) << site.name;
    EXPECT_NEAR(sources[k].start_ms, 92 + value("time_ms"), 1e-9);
    if (k > normal) continue;
    EXPECT_LT(least, 1.5 * heart.grid.dx_mm) << site.name;
    cells.insert(sources[k].cell);
  }
  EXPECT_EQ(cells.size(), normal);
}

TEST(ConductionSystem, TheFastLayerLiesAlongTheEndocardiumBelowItsHeight) {
  Scene scene = coarse_heart();
  declare(scene, 4);
  Parts heart(scene);
  const auto sheet = heart.read<std::uint8_t>(heart.activation.network().sheet().id, 1);
  const auto depth = heart.read<float>(heart.activation.network().sheet().depth, 1);
  std::array<int, 3> counts{};
  int beyond = 0;
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    if (heart.tissue.regions[i] == 255) continue;
    const std::string& region = scene.regions[heart.tissue.regions[i]].name;
    const bool ventricle = region == "lv" || region == "rv";
    const bool left = region == "lv" && heart.coordinate(0, i) <= 0.5;
    const double rim = left ? 0.85 : 1.0;
    const bool along = ventricle && std::abs(heart.coordinate(3, i)) <= 4;
    const bool within = along && heart.coordinate(1, i) <= rim;
    if (!within && sheet[i] != 0) {  // the row beyond the rim: the layer's wave only comes out there
      ++beyond;
      EXPECT_TRUE(along) << i;
      EXPECT_EQ(static_cast<int>(sheet[i]), left ? 1 : 2) << i;
      EXPECT_LT(heart.coordinate(1, i), rim + 4.0 / 90) << i;
      EXPECT_LT(depth[i], 0) << i;
      continue;
    }
    EXPECT_EQ(static_cast<int>(sheet[i]), within ? (left ? 1 : 2) : 0) << i;
    // The wave's way across fibres, at 0.25 mm/ms.
    if (within) {
      EXPECT_NEAR(depth[i], std::max(0.0, heart.coordinate(3, i)) / 0.25, 1e-4) << i;
    }
    if (std::abs(heart.coordinate(3, i)) <= 2) ++counts[sheet[i]];
  }
  // The left endocardium below its height is an ellipsoid of semi-axes 25, 25, 65 mm cut at two places: some
  // 12000 mm2.
  const double left_area = counts[1] * 16.0;
  EXPECT_GT(left_area, 8000);
  EXPECT_LT(left_area, 18000);
  EXPECT_GT(counts[2], 0);
  EXPECT_GT(beyond, 20);
}

// From one site, through tissue that hardly conducts: the layer alone carries the wave.
TEST(ConductionSystem, TheFastLayerConductsAtItsVelocity) {
  Scene scene = coarse_heart();
  scene.conduction_system->early_sites = {default_early_sites().front()};
  declare(scene, 4);
  const auto wave = [&](double velocity) {
    Parts heart(scene, {{"electrophysiology.conduction_system.fast_layer_velocity_mm_per_ms", velocity},
                        {"electrophysiology.velocity_longitudinal_mm_per_ms", 0.01},
                        {"electrophysiology.velocity_transverse_mm_per_ms", 0.01},
                        {"electrophysiology.regions.ra.velocity_longitudinal_mm_per_ms", 1},
                        {"electrophysiology.regions.ra.velocity_transverse_mm_per_ms", 1}});
    const auto sheet = heart.read<std::uint8_t>(heart.activation.network().sheet().id, 1);
    const auto arrival = heart.read<float>(heart.activation.arrival(), 1);
    const auto depth = heart.read<float>(heart.activation.network().sheet().depth, 1);
    const Eikonal::Source site = heart.activation.network().sources().back();
    const auto first = static_cast<size_t>(site.cell);
    // (straight distance from the site, mm; when the layer's wave passes after it, ms) of the cells in
    // the site's layer.
    std::vector<std::pair<double, double>> result;
    const std::array<double, 3> from = site.point.value(), beside = heart.tissue.centre(first);
    const double off = std::hypot(beside[0] - from[0], beside[1] - from[1], beside[2] - from[2]),
                 way = std::sqrt(std::max(0.0, off * off - std::pow(heart.coordinate(3, first), 2)));
    for (std::size_t i = 0; i < sheet.size(); ++i) {
      if (heart.tissue.regions[i] == 255 || sheet[i] != sheet[first] || depth[i] < 0) continue;
      const std::array<double, 3> at = heart.tissue.centre(i);
      result.emplace_back(std::hypot(at[0] - from[0], at[1] - from[1], at[2] - from[2]),
                          static_cast<double>(arrival[i] - depth[i]) -
                              static_cast<double>(arrival[first] - depth[first]) + way / velocity);
    }
    return result;
  };
  constexpr double slow_mm_per_ms = 1.2, fast_mm_per_ms = 3;
  const auto slow = wave(slow_mm_per_ms), fast = wave(fast_mm_per_ms);
  ASSERT_EQ(slow.size(), fast.size());
  int far = 0;
  for (std::size_t k = 0; k < slow.size(); ++k) {
    const auto [distance, time] = slow[k];
    if (time > 1e6) continue;  // a cell that the layer does not join
    EXPECT_NEAR(time * slow_mm_per_ms, fast[k].second * fast_mm_per_ms, 0.01 * time * slow_mm_per_ms + 1e-3);
    if (distance < 20 || distance > 30) continue;
    ++far;  // the way over the wall is hardly longer than the straight one
    EXPECT_GT(time * slow_mm_per_ms, 0.9 * distance);
    EXPECT_LT(time * slow_mm_per_ms, 1.6 * distance);
  }
  EXPECT_GT(far, 50);
}

TEST(ConductionSystem, VentriclesFollowTheNodeAndItsDelay) {
  Scene scene = coarse_heart();
  declare(scene);
  const auto arrivals = [&](const Changes& changes) {
    Parts heart(scene, changes);
    return std::pair{heart.activation.activation(heart.tissue, 1e6), heart.tissue.regions};
  };
  const std::string system = "electrophysiology.conduction_system.";
  const auto [early, regions] = arrivals({});
  const auto [late, same] = arrivals({{system + "atrioventricular_delay_ms", 192}});
  const auto [shifted, again] = arrivals({{system + "sinoatrial_start_ms", 50}});
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i] == 255) continue;
    const bool ventricle = scene.regions[regions[i]].name == "lv" || scene.regions[regions[i]].name == "rv";
    ASSERT_GE(early[i], 0) << "no wave comes to cell " << i;
    EXPECT_NEAR(late[i] - early[i], ventricle ? 100 : 0, 1e-2) << i;
    EXPECT_NEAR(shifted[i] - early[i], 40, 1e-2) << i;
  }
}

// Above the base the outflow and the right atrium come within a corner of each other.
TEST(ConductionSystem, ThePathAloneLeadsFromAtriaToVentricles) {
  Scene scene = coarse_heart();
  scene.conduction_system->kind = ConductionSystem::Kind::path;
  declare(scene, 2);
  Parts heart(scene, {});
  const std::vector<float> arrival = heart.activation.activation(heart.tissue, 1e6);
  std::map<std::string, float> first;
  for (std::size_t i = 0; i < arrival.size(); ++i) {
    if (heart.tissue.regions[i] == 255) continue;
    float& time = first.try_emplace(scene.regions[heart.tissue.regions[i]].name, arrival[i]).first->second;
    time = std::min(time, arrival[i]);
  }
  EXPECT_LT(first.at("ra"), first.at("conduction_path"));
  EXPECT_LT(first.at("conduction_path"), first.at("lv"));
  EXPECT_LT(first.at("conduction_path"), first.at("rv"));
}

}  // namespace
}  // namespace cohort::test
