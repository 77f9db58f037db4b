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
                          {"electrophysiology.velocity_transverse_mm_per_ms", 0.25},
                          {slope + "transmural", -12},
                          {slope + "apico_basal", 22},
                          {slope + "lateral", 13}};
  for (const auto& [path, value] : values) scene.parameters[scene.parameters.index(path)].value = value;
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
  Scene scene = coarse_heart();
  declare(scene, 4);
  Parts heart(scene);
  const auto sheet = heart.read<std::uint8_t>(heart.activation.network().sheet().id, 1);
  const std::vector<Eikonal::Source>& sources = heart.activation.network().sources();
  ASSERT_EQ(sources.size(), 1 + scene.conduction_system->early_sites.size());
  std::set<int> cells;
  for (size_t k = 1; k < sources.size(); ++k) {
    const auto& site = scene.conduction_system->early_sites[k - 1];
    const auto value = [&](const char* name) {
      return heart.one.values[static_cast<size_t>(scene.parameters.index(
          "electrophysiology.conduction_system.early_sites." + site.name + "." + name))];
    };
    const std::size_t found = static_cast<size_t>(sources[k].cell);
    const auto distance = [&](std::size_t i) {
      const std::array<double, 3> p = heart.tissue.centre(i);
      const double up = (heart.coordinate(1, i) - value("height")) * 90;
      const double turn = heart.coordinate(2, i) - value("angle_deg") * std::numbers::pi / 180;
      return std::hypot(up, std::hypot(p[0], p[1]) * std::remainder(turn, 2 * std::numbers::pi));
    };
    using Surface = ConductionSystem::Surface;
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
    EXPECT_LT(least, 1.5 * heart.grid.dx_mm) << site.name;
    EXPECT_NEAR(sources[k].start_ms, 92 + value("time_ms"), 1e-9);
    cells.insert(sources[k].cell);
  }
  EXPECT_EQ(cells.size(), scene.conduction_system->early_sites.size());
}

TEST(ConductionSystem, TheFastLayerStraddlesTheEndocardiumBelowItsHeight) {
  Scene scene = coarse_heart();
  declare(scene, 4);
  Parts heart(scene);
  const auto sheet = heart.read<std::uint8_t>(heart.activation.network().sheet().id, 1);
  std::array<int, 3> counts{};
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    if (heart.tissue.regions[i] == 255) continue;
    const std::string& region = scene.regions[heart.tissue.regions[i]].name;
    const bool ventricle = region == "lv" || region == "rv";
    const bool left = region == "lv" && heart.coordinate(0, i) <= 0.5;
    const bool within =
        ventricle && std::abs(heart.coordinate(3, i)) <= 2 && heart.coordinate(1, i) <= (left ? 0.85 : 1.0);
    EXPECT_EQ(static_cast<int>(sheet[i]), within ? (left ? 1 : 2) : 0) << i;
    ++counts[sheet[i]];
  }
  // The left endocardium below its height is an ellipsoid of semi-axes 25, 25, 65 mm cut at two places: some
  // 12000 mm2.
  const double left_area = counts[1] * 16.0;
  EXPECT_GT(left_area, 8000);
  EXPECT_LT(left_area, 18000);
  EXPECT_GT(counts[2], 0);
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
// `spacing` after the crossing of 0 mV, driven to it from rest.
std::vector<double> action_potential(double tau, double spacing, double length) {
  constexpr double dt = 0.01;
  double v = 0, h = 1, since = -1;
  std::vector<double> potential;
  for (double t = 0; since < length; t += dt) {
    const double drive = since < 0 ? 35.714 / 105 : 0;
    const auto rate = [&](double x) { return h * x * x * (1 - x) / 0.3 - x / 6 + drive; };
    const double before = v;
    v += dt * rate(v + 0.5 * dt * rate(v));
    h = v < 0.13 ? 1 + (h - 1) * std::exp(-dt / 120) : h * std::exp(-dt / tau);
    const double threshold = 85.0 / 105;
    if (since < 0 && v >= threshold)
      since = dt * (v - threshold) / (v - before);
    else if (since >= 0)
      since += dt;
    while (since >= static_cast<double>(potential.size()) * spacing) potential.push_back(105 * v - 85);
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

// Not a heart without conduction, nor one without action potentials: no flat ECG.
TEST(TemplateEcg, RejectsMembersWithoutVelocityOrActionPotential) {
  Scene scene = coarse_heart();
  declare(scene);
  const std::string root = "electrophysiology.";
  const std::vector<Member> members = {
      member(scene, 0, {}), member(scene, 1, {{root + "velocity_transverse_mm_per_ms", 0}}),
      member(scene, 2, {{root + "activation_threshold_mV", 60}}),
      member(scene, 3, {{root + "regions.ra.velocity_longitudinal_mm_per_ms", 0}})};
  const std::vector<Recording> alone = run(scene, members, 1), together = run(scene, members, 4);
  const char* reasons[] = {"", "velocity_longitudinal_mm_per_ms", "activation_threshold_mV",
                           "\"ra\" has none"};
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
  Scene scene = coarse_heart();
  declare(scene);
  const std::string path = "electrophysiology.velocity_longitudinal_mm_per_ms";
  const std::vector<Member> sampled = {member(scene, 0, {{path, 0}}), member(scene, 1, {{path, 0.7}})};
  const std::vector<Member> all = {member(scene, 0, {{path, 0.5}}), member(scene, 1, {{path, 0.7}})};
  scene.parameters[scene.parameters.index(path)].value = 0;
  const auto planned = [&](ActivationMethod method, std::span<const Member> members) {
    scene.activation_method = method;
    return make_plan(device(), scene, members, {});
  };
  EXPECT_THROW(planned(ActivationMethod::eikonal, {}), std::invalid_argument);
  EXPECT_THROW(planned(ActivationMethod::eikonal, std::span(sampled).first(1)), std::invalid_argument);
  EXPECT_EQ(planned(ActivationMethod::eikonal, all).activation, ActivationMethod::eikonal);
  EXPECT_EQ(planned(ActivationMethod::automatic, all).activation, ActivationMethod::eikonal);
  // Cables give the velocity of a member that has none.
  EXPECT_EQ(planned(ActivationMethod::automatic, sampled).activation, ActivationMethod::reaction_eikonal);
  const Plan plan = planned(ActivationMethod::eikonal, sampled);
  EXPECT_EQ(plan.conduction.front().region, scene.regions.front().name + " of member 1");
  EXPECT_EQ(plan.conduction.front().along_mm_per_ms, 0.7);
  const std::vector<Recording> recordings = run(scene, sampled, 2);
  EXPECT_EQ(recordings[0].outcome, Outcome::rejected);
  EXPECT_EQ(recordings[1].outcome, Outcome::done) << recordings[1].reason;
}

TEST(TemplateEcg, RefusesWhatItCannotTabulate) {
  Scene scene = coarse_heart();
  scene.heterogeneity.parameters = {"tau_close_ms", "tau_out_ms"};
  declare(scene);
  EXPECT_THROW(make_plan(device(), scene, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace cohort::test
