// ECGs from arrival times and templates, on a coarse heart.
#include <cmath>
#include <cstring>

#include "tests/coarse_heart.hpp"

namespace cohort::test {
namespace {

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

// The series by templates, (samples, leads and one); weights (leads, stride) and arrival (stride) that it is
// of.
struct Projection {
  std::vector<double> series;
  std::vector<float> weights, arrival;
};

Projection project(Parts& heart) {
  LeadWeights weights(heart.launcher, heart.scene, heart.definitions, 1);
  Diffusion diffusion(heart.launcher, heart.scene, heart.definitions);
  weights.assemble(heart.tissue, diffusion, heart.parameters, {&heart.one, 1});
  TemplateEcg templates(heart.launcher, heart.scene, heart.definitions, 1);
  return {templates.series(heart.tissue, heart.parameters, heart.activation.arrival(), weights.weights(),
                           {&heart.one, 1}),
          heart.read<float>(weights.weights(), LeadWeights::leads),
          heart.read<float>(heart.activation.arrival(), 1)};
}

TEST(TemplateEcg, EqualsEachCellsOwnActionPotential) {
  Scene scene = coarse_heart();
  declare(scene);
  Parts heart(scene);
  const auto [series, w, arrival] = project(heart);
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
  const auto [series, w, arrival] = project(heart);
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
