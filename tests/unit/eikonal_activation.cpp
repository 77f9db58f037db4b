// The conduction system's cells, and ECGs from arrival times and templates, on a coarse heart.
#include "solver/eikonal_activation.hpp"

#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>

#include "solver/template_ecg.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Changes = std::vector<std::pair<std::string, double>>;
const std::string tau_close = "electrophysiology.mitchell_schaeffer.tau_close_ms";
const std::string slope = "electrophysiology.heterogeneity.tau_close_ms.";

Scene coarse_heart() {
  Scene scene;
  scene.geometry = GeometryKind::heart;
  scene.activation_method = ActivationMethod::eikonal;
  scene.conduction_system.emplace().early_sites = default_early_sites();
  scene.heterogeneity.parameters = {"tau_close_ms"};
  scene.ecg.emplace();
  scene.activation.emplace();
  return scene;
}

void declare(Scene& scene, double dx_mm = 5) {
  declare_parameters(scene);
  const Changes values = {{"grid.dx_mm", dx_mm},
                          {"time.end_ms", 700},
                          {"outputs.ecg.rate_hz", 500},
                          {"torso.dx_mm", 20},
                          {"electrophysiology.velocity_longitudinal_mm_per_ms", 0.6},
                          {"electrophysiology.velocity_transverse_mm_per_ms", 0.25}};
  const Changes slopes = {{slope + "transmural", -12}, {slope + "apico_basal", 22}, {slope + "lateral", 13}};
  for (const Changes* changes : {&values, &slopes})
    for (const auto& [path, value] : *changes)
      if (changes != &slopes || !scene.heterogeneity.parameters.empty())
        scene.parameters[scene.parameters.index(path)].value = value;
}

Member member(const Scene& scene, std::int64_t id, const Changes& changes) {
  Member result{id, scene.parameters.values()};
  for (const auto& [path, value] : changes)
    result.values[static_cast<size_t>(scene.parameters.index(path))] = value;
  scene.parameters.resolve(result.values);
  return result;
}

std::vector<Recording> run(const Scene& scene, const std::vector<Member>& members, int batch) {
  PlanOptions options;
  options.members_per_device = batch;
  const Plan plan = make_plan(device(), scene, members, options);
  EXPECT_EQ(plan.activation, ActivationMethod::eikonal);
  Simulation simulation(device(), scene, plan);
  std::vector<Recording> recordings;
  for (size_t first = 0; first < members.size(); first += static_cast<size_t>(batch)) {
    const size_t count = std::min(static_cast<size_t>(batch), members.size() - first);
    for (Recording& recording : simulation.run(std::span(members).subspan(first, count), 600))
      recordings.push_back(std::move(recording));
  }
  return recordings;
}

// Parts of the solver on one heart.
struct Parts {
  explicit Parts(const Scene& scene_, const Changes& changes = {})
      : scene(scene_),
        one(member(scene, 0, changes)),
        grid(make_grid(scene, {&one, 1})),
        definitions(scene_definitions(scene, grid)),
        launcher(device(), scene.precision),
        tissue(launcher, scene, grid, 1),
        activation(launcher, scene, definitions, 1) {
    const std::vector<std::byte> packed = pack(one.values, scene.precision);
    parameters = device().allocate(packed.size());
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    tissue.build(parameters, 1);
    tissue.build_fibres(parameters);
    tissue.build_coordinates(parameters);
    coordinates = read<float>(tissue.coordinates, 4);
    activation.assemble(tissue, parameters, {&one, 1});
  }
  template <typename T>
  std::vector<T> read(const cl::Buffer& buffer, std::size_t rows) {
    std::vector<T> host(rows * static_cast<size_t>(tissue.stride));
    launcher.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, host.size() * sizeof(T), host.data());
    return host;
  }
  double coordinate(std::size_t row, std::size_t i) const {
    return static_cast<double>(coordinates[row * static_cast<size_t>(tissue.stride) + i]);
  }

  Scene scene;
  Member one;
  Grid grid;
  Definitions definitions;
  Launcher launcher;
  Tissue tissue;
  EikonalActivation activation;
  cl::Buffer parameters;
  std::vector<float> coordinates;
};

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
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    if (heart.tissue.regions[i] == 255) continue;
    const std::string& region = scene.regions[heart.tissue.regions[i]].name;
    const bool ventricle = region == "lv" || region == "rv";
    const bool left = region == "lv" && heart.coordinate(0, i) <= 0.5;
    const bool within =
        ventricle && std::abs(heart.coordinate(3, i)) <= 4 && heart.coordinate(1, i) <= (left ? 0.85 : 1.0);
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
    const auto first = static_cast<size_t>(heart.activation.network().sources().back().cell);
    // (straight distance from the site, mm; when the layer's wave passes after it, ms) of the cells in the
    // site's layer.
    std::vector<std::pair<double, double>> result;
    const std::array<double, 3> from = heart.tissue.centre(first);
    for (std::size_t i = 0; i < sheet.size(); ++i) {
      if (heart.tissue.regions[i] == 255 || sheet[i] != sheet[first]) continue;
      const std::array<double, 3> at = heart.tissue.centre(i);
      result.emplace_back(std::hypot(at[0] - from[0], at[1] - from[1], at[2] - from[2]),
                          static_cast<double>(arrival[i]) - (i == first ? 0 : static_cast<double>(depth[i])) -
                              static_cast<double>(arrival[first]));
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

// The equations of kernels/cells/mitchell_schaeffer.cl on the host, finely: potential at multiples of
// `spacing` from `foot` before the crossing of 0 mV until `length` after it, driven to it from rest.
std::vector<double> action_potential(double tau, double spacing, double length, double foot = 0,
                                     double rest_mV = -85) {
  constexpr double dt = 0.01;
  const double threshold = -rest_mV / 105;
  double v = 0, h = 1, crossing = -1;
  std::vector<double> driven = {0};  // v at multiples of dt
  for (double t = 0; crossing < 0 || t < crossing + length + 2 * dt; t += dt) {
    double drive = crossing < 0 ? 35.714 / 105 : 0;
    const auto rate = [&](double x) { return h * x * x * (1 - x) / 0.3 - x / 6 + drive; };
    const auto stepped = [&] { return v + dt * rate(v + 0.5 * dt * rate(v)); };
    double next = stepped();
    if (crossing < 0 && next >= threshold) {  // the drive ends there, within the step
      const double share = (threshold - v) / (next - v);
      crossing = t + share * dt;
      drive *= share;
      next = stepped();
    }
    v = next;
    h = v < 0.13 ? 1 + (h - 1) * std::exp(-dt / 120) : h * std::exp(-dt / tau);
    driven.push_back(v);
  }
  std::vector<double> potential;
  for (std::size_t k = 0; static_cast<double>(k) * spacing <= foot + length; ++k) {
    const double at = std::max((crossing - foot + static_cast<double>(k) * spacing) / dt, 0.0);
    const auto n = static_cast<size_t>(at);
    potential.push_back(105 * std::lerp(driven[n], driven[n + 1], at - std::floor(at)) + rest_mV);
  }
  return potential;
}

TEST(TemplateEcg, EqualsEachCellsOwnActionPotential) {
  Scene scene = coarse_heart();
  declare(scene);
  Parts heart(scene);
  LeadWeights weights(heart.launcher, scene, heart.definitions, 1);
  Diffusion diffusion(heart.launcher, scene, heart.definitions);
  weights.assemble(heart.tissue, diffusion, heart.parameters, {&heart.one, 1});
  TemplateEcg templates(heart.launcher, scene, heart.definitions, 1);
  const std::vector<double> series = templates.series(
      heart.tissue, heart.parameters, heart.activation.arrival(), weights.weights(), {&heart.one, 1});
  const auto w = heart.read<float>(weights.weights(), LeadWeights::leads);
  const auto arrival = heart.read<float>(heart.activation.arrival(), 1);
  const std::size_t samples = layout(scene).ecg_ms.size(), quantities = LeadWeights::leads + 1;
  ASSERT_EQ(series.size(), samples * quantities);

  constexpr double interval = 2, spacing = 0.1;
  const double base = heart.one.values[static_cast<size_t>(scene.parameters.index(tau_close))];
  std::vector<double> exact(samples * LeadWeights::leads, 0);
  std::map<int, std::vector<double>> known;  // by tenths of a ms of tau_close
  for (std::size_t i = 0; i < heart.tissue.regions.size(); ++i) {
    if (heart.tissue.regions[i] == 255) continue;
    const std::string& region = scene.regions[heart.tissue.regions[i]].name;
    double tau = base;
    if (region == "lv" || region == "rv")
      tau += -12 * (heart.coordinate(0, i) - 0.5) + 22 * (heart.coordinate(1, i) - 0.5) +
             13 * std::cos(heart.coordinate(2, i));
    const int key = static_cast<int>(std::lround(10 * tau));
    if (!known.contains(key)) known[key] = action_potential(key / 10.0, spacing, 720);
    const std::vector<double>& V = known[key];
    for (std::size_t k = 0; k < samples; ++k) {
      const double since = (static_cast<double>(k) * interval - static_cast<double>(arrival[i])) / spacing;
      // The foot before the crossing, a few ms of the drive, is left to the templates.
      const double u = since < 0 ? 0
                                 : std::lerp(V[static_cast<size_t>(since)], V[static_cast<size_t>(since) + 1],
                                             since - std::floor(since)) +
                                       85;
      for (std::size_t q = 0; q < LeadWeights::leads; ++q)
        exact[k * LeadWeights::leads + q] +=
            static_cast<double>(w[q * static_cast<size_t>(heart.tissue.stride) + i]) * u;
    }
  }
  // ST and T, where the foot of the upstroke has no say: all cells are activated by then.
  double error = 0, size = 0;
  const float last = *std::max_element(arrival.begin(), arrival.end(), [](float a, float b) {
    return (a < Eikonal::unreached_ms ? a : 0) < (b < Eikonal::unreached_ms ? b : 0);
  });
  for (auto k = static_cast<std::size_t>((last + 10) / interval); k < samples; ++k) {
    EXPECT_EQ(series[k * quantities + LeadWeights::leads], 0) << "a potential of no use at sample " << k;
    for (std::size_t q = 0; q < LeadWeights::leads; ++q) {
      const double a = series[k * quantities + q], b = exact[k * LeadWeights::leads + q];
      error += (a - b) * (a - b);
      size += b * b;
    }
  }
  std::printf("templates against each cell's own action potential: %.2f %% RMS\n",
              100 * std::sqrt(error / size));
  EXPECT_LT(std::sqrt(error / size), 0.01);
}

// Without slopes a cell's potential is that of its region at any time, which templates know every 0.25 ms:
// samples 2 ms apart, arrivals anywhere between them, and regions whose cells rest at other potentials.
TEST(TemplateEcg, QrsBetweenThePhasesOfTheTable) {
  Scene scene = coarse_heart();
  scene.heterogeneity.parameters.clear();
  declare(scene);
  std::map<std::string, double> rest;
  for (const Region& region : scene.regions) rest[region.name] = -85;
  rest["rv"] = -79;
  rest["la"] = -92;
  Changes changes;
  for (const auto& [region, mV] : rest)
    if (scene.parameters.find("electrophysiology.regions." + region + ".resting_mV") >= 0)
      changes.emplace_back("electrophysiology.regions." + region + ".resting_mV", mV);
  Parts heart(scene, changes);
  LeadWeights weights(heart.launcher, scene, heart.definitions, 1);
  Diffusion diffusion(heart.launcher, scene, heart.definitions);
  weights.assemble(heart.tissue, diffusion, heart.parameters, {&heart.one, 1});
  TemplateEcg templates(heart.launcher, scene, heart.definitions, 1);
  const std::vector<double> series = templates.series(
      heart.tissue, heart.parameters, heart.activation.arrival(), weights.weights(), {&heart.one, 1});
  const auto w = heart.read<float>(weights.weights(), LeadWeights::leads);
  const auto arrival = heart.read<float>(heart.activation.arrival(), 1);
  const std::size_t samples = layout(scene).ecg_ms.size(), quantities = LeadWeights::leads + 1;

  constexpr double interval = 2, spacing = 0.01, foot = 5;
  const double tau = heart.one.values[static_cast<size_t>(scene.parameters.index(tau_close))];
  std::map<std::string, std::vector<double>> V;
  for (const auto& [region, mV] : rest) V[region] = action_potential(tau, spacing, 720, foot, mV);
  std::vector<double> exact(samples * LeadWeights::leads, 0);
  double first = 1e9, last = 0;  // of the ventricles' activation
  for (std::size_t i = 0; i < heart.tissue.regions.size(); ++i) {
    if (heart.tissue.regions[i] == 255) continue;
    const std::string& region = scene.regions[heart.tissue.regions[i]].name;
    const double T = static_cast<double>(arrival[i]);
    if (region == "lv" || region == "rv") first = std::min(first, T), last = std::max(last, T);
    for (std::size_t k = 0; k < samples; ++k) {
      const double at = std::max((static_cast<double>(k) * interval - T + foot) / spacing, 0.0);
      const auto n = static_cast<size_t>(at);
      // Relative to what one region rests at: leads do not see a potential that is everywhere the same.
      const double u = std::lerp(V[region][n], V[region][n + 1], at - std::floor(at)) + 85;
      for (std::size_t q = 0; q < LeadWeights::leads; ++q)
        exact[k * LeadWeights::leads + q] +=
            static_cast<double>(w[q * static_cast<size_t>(heart.tissue.stride) + i]) * u;
    }
  }
  double error = 0, size = 0, before = 0;
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * interval;
    for (std::size_t q = 0; q < LeadWeights::leads; ++q) {
      const double a = series[k * quantities + q], b = exact[k * LeadWeights::leads + q];
      if (t > first && t < last) {
        error += (a - b) * (a - b);
        size += b * b;
      } else if (t < 3) {  // before the sinoatrial node fires: all rest
        before = std::max(before, std::abs(a - b) / std::max(std::abs(b), 1e-6));
      }
    }
  }
  std::printf("QRS by templates against each cell's own action potential: %.3f %% RMS; at rest %.3f %%\n",
              100 * std::sqrt(error / size), 100 * before);
  EXPECT_LT(std::sqrt(error / size), 0.002);
  EXPECT_LT(before, 0.01);
}

TEST(TemplateEcg, AMembersBytesDoNotDependOnItsBatch) {
  Scene scene = coarse_heart();
  declare(scene);
  const std::vector<Member> members = {
      member(scene, 0, {}), member(scene, 1, {{tau_close, 120}, {"geometry.heart.lv_radius_mm", 28}}),
      member(scene, 2, {{"torso.half_width_mm", 185}}),
      member(scene, 3, {{"electrophysiology.regions.la.tau_close_ms", 60}, {slope + "lateral", 0}}),
      member(scene, 4,
             {{"torso.heart.position_mm.x", 300}})};  // outside the torso: rejected, the others are not
  const std::vector<Recording> alone = run(scene, members, 1), together = run(scene, members, 5),
                               pairs = run(scene, members, 2);
  for (size_t m = 0; m < members.size(); ++m) {
    ASSERT_EQ(alone[m].outcome, m == 4 ? Outcome::rejected : Outcome::done) << alone[m].reason;
    for (const auto* other : {&together, &pairs}) {
      const Recording& recording = (*other)[m];
      ASSERT_EQ(recording.outcome, alone[m].outcome) << recording.reason;
      for (const auto& [a, b] :
           {std::pair{&alone[m].ecg, &recording.ecg}, std::pair{&alone[m].features, &recording.features}}) {
        ASSERT_EQ(a->size(), b->size());
        EXPECT_EQ(std::memcmp(a->data(), b->data(), a->size() * sizeof(float)), 0) << m;
      }
    }
  }
  EXPECT_NE(alone[1].ecg, alone[0].ecg);
  EXPECT_NE(alone[2].ecg, alone[0].ecg);
  EXPECT_NE(alone[3].ecg, alone[0].ecg);
}

// Not a heart without conduction, nor one without action potentials, nor one with layers that cross: no ECG.
TEST(TemplateEcg, RejectsMembersWithoutVelocityOrActionPotential) {
  Scene scene = coarse_heart();
  declare(scene);
  const std::string root = "electrophysiology.";
  const std::vector<Member> members = {
      member(scene, 0, {}), member(scene, 1, {{root + "velocity_transverse_mm_per_ms", 0}}),
      member(scene, 2, {{root + "activation_threshold_mV", 60}}),
      member(scene, 3, {{root + "regions.ra.velocity_longitudinal_mm_per_ms", 0}}),
      member(scene, 4, {{root + "heterogeneity.endocardial_until", 0.9}})};
  const std::vector<Recording> alone = run(scene, members, 1), together = run(scene, members, 5);
  const char* reasons[] = {"", "velocity_longitudinal_mm_per_ms", "activation_threshold_mV",
                           "\"ra\" has none", "the layers of the wall cross"};
  for (const auto* recordings : {&alone, &together}) {
    EXPECT_EQ((*recordings)[0].outcome, Outcome::done) << (*recordings)[0].reason;
    for (size_t m = 1; m < members.size(); ++m) {
      const Recording& recording = (*recordings)[m];
      EXPECT_EQ(recording.outcome, Outcome::rejected) << m;
      EXPECT_NE(recording.reason.find(reasons[m]), std::string::npos) << recording.reason;
      EXPECT_TRUE(
          std::all_of(recording.ecg.begin(), recording.ecg.end(), [](float x) { return std::isnan(x); }));
    }
    EXPECT_EQ(
        std::memcmp((*recordings)[0].ecg.data(), alone[0].ecg.data(), alone[0].ecg.size() * sizeof(float)),
        0);
  }
}

// A velocity that the scene leaves to the members: those that have one run.
TEST(EikonalActivation, TakesVelocitiesThatAreSampledOnly) {
  const std::string path = "electrophysiology.velocity_longitudinal_mm_per_ms";
  const auto without_velocity = [&](ActivationMethod method) {
    Scene scene = coarse_heart();
    scene.activation_method = method;
    declare(scene);
    scene.parameters[scene.parameters.index(path)].value = 0;
    return scene;
  };
  const auto planned = [&](const Scene& scene, double first, double second) {
    const std::vector<Member> members = {member(scene, 0, {{path, first}}),
                                         member(scene, 1, {{path, second}})};
    return make_plan(device(), scene, members, {});
  };
  const Scene scene = without_velocity(ActivationMethod::eikonal);
  EXPECT_THROW(make_plan(device(), scene, {}, {}), std::invalid_argument);
  EXPECT_THROW(planned(scene, 0, 0), std::invalid_argument);
  EXPECT_EQ(planned(scene, 0.5, 0.7).activation, ActivationMethod::eikonal);
  const Plan plan = planned(scene, 0, 0.7);
  EXPECT_EQ(plan.conduction.front().region, scene.regions.front().name + " of member 1");
  EXPECT_EQ(plan.conduction.front().along_mm_per_ms, 0.7);
  const std::vector<Recording> recordings =
      run(scene, {member(scene, 0, {{path, 0}}), member(scene, 1, {{path, 0.7}})}, 2);
  EXPECT_EQ(recordings[0].outcome, Outcome::rejected);
  EXPECT_EQ(recordings[1].outcome, Outcome::done) << recordings[1].reason;

  const Scene open = without_velocity(ActivationMethod::automatic);
  EXPECT_EQ(planned(open, 0.5, 0.7).activation, ActivationMethod::eikonal);
  // Cables give the velocity of a member that has none.
  EXPECT_EQ(planned(open, 0, 0.7).activation, ActivationMethod::reaction_eikonal);
}

TEST(TemplateEcg, RefusesWhatItCannotTabulate) {
  Scene scene = coarse_heart();
  scene.heterogeneity.parameters = {"tau_close_ms", "tau_out_ms"};
  declare(scene);
  EXPECT_THROW(make_plan(device(), scene, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace cohort::test
