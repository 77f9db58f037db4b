// Conduction velocities from cables, and the reaction-eikonal model on the slab of Niederer et al. 2011.
#include "solver/reaction_eikonal.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "solver/conduction.hpp"
#include "solver/observer.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Vector = std::array<double, 3>;

Cable cable_of(const std::string& model) {
  Cable cable{model, {}, 0, 35.714, 2};
  for (const Parameter& p : read_cell_model(model).parameters) cable.cell.push_back(p.value);
  return cable;
}

// The frozen gate's front of Mitchell and Schaeffer's cubic: exact.
TEST(Conduction, FrozenGate) {
  Cable cable = cable_of("mitchell_schaeffer");
  const CellModel model = read_cell_model("mitchell_schaeffer");
  double tau_in = 0, tau_out = 0;
  for (size_t k = 0; k < model.parameters.size(); ++k) {
    const std::string& name = model.parameters[k].path;
    if (name == "tau_close_ms" || name == "tau_open_ms") cable.cell[k] = 1e9;
    if (name == "tau_in_ms") tau_in = cable.cell[k];
    if (name == "tau_out_ms") tau_out = cable.cell[k];
  }
  Conduction conduction(device(), Precision::single_);
  const auto start = std::chrono::steady_clock::now();
  const Front front = conduction.converged({cable})[0];
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double root = std::sqrt(1 - 4 * tau_in / tau_out);
  const double exact = std::sqrt(1 / (2 * tau_in)) * ((1 + root) / 2 - (1 - root));
  std::printf(
      "frozen gate: %.4f mm/ms for 1 mm2/ms, exact %.4f; width %.2f mm, latency %.3f ms; "
      "%.2f s\n",
      front.speed, exact, front.width_mm, front.latency_ms, seconds);
  EXPECT_NEAR(front.speed / exact, 1, 0.01);
}

// How wide a front must be, in cells, for the monodomain equation on a grid: what the plan decides by.
TEST(Conduction, FrontsOnGrids) {
  Conduction conduction(device(), Precision::single_);
  for (const char* name : {"mitchell_schaeffer", "ten_tusscher_panfilov"}) {
    const Cable cable = cable_of(name);
    const Front front = conduction.converged({cable})[0];
    std::printf("%s: %.4f mm/ms for 1 mm2/ms, front %.2f mm wide, latency %.2f ms\n", name, front.speed,
                front.width_mm, front.latency_ms);
    for (const double cells : {6.0, 3.0, 1.5, 0.5}) {
      const double speed = conduction.on_grid(cable, front.width_mm / cells);
      std::printf("  %.1f cells: %.4f, %+.1f %%\n", cells, speed, 100 * (speed / front.speed - 1));
      if (cells >= 1.5) {
        EXPECT_NEAR(speed / front.speed, 1, 0.1);
      }
      if (cells < 1) {
        EXPECT_LT(speed / front.speed, 0.8);
      }
    }
  }
}

// A cable's front is its own, whichever cables run beside it: a fast one has left its cable long before a
// slow one comes to the end of it, and a stretch that conducts nothing must not hold up the rest.
TEST(Conduction, AFrontDoesNotDependOnTheOtherCables) {
  Cable fast = cable_of("mitchell_schaeffer"), slow = fast, silent = fast;
  const CellModel model = read_cell_model("mitchell_schaeffer");
  for (size_t k = 0; k < model.parameters.size(); ++k)
    if (model.parameters[k].path == "tau_in_ms") fast.cell[k] = 0.1, slow.cell[k] = 0.6;
  silent.amplitude_mV_per_ms = 0.1;
  Conduction batch(device(), Precision::single_);
  const std::vector<Front> together = batch.converged({slow, silent, fast});
  EXPECT_EQ(together[1].speed, 0);
  for (const auto& [cable, front] : {std::pair{slow, together[0]}, std::pair{fast, together[2]}}) {
    Conduction own(device(), Precision::single_);
    const Front alone = own.converged({cable})[0];
    std::printf("speed %.4f, width %.3f mm alone, %.3f in the batch\n", alone.speed, alone.width_mm,
                front.width_mm);
    EXPECT_EQ(front.speed, alone.speed);
    EXPECT_EQ(front.width_mm, alone.width_mm);
    EXPECT_EQ(front.latency_ms, alone.latency_ms);
  }
  // Upstrokes of some ms: amplitude over the steepest rise, times the speed.
  EXPECT_GT(together[2].width_mm, 0.5);
  EXPECT_LT(together[2].width_mm, 3);
}

using Changes = std::vector<std::pair<std::string, double>>;

struct Strip {
  Scene scene;
  explicit Strip(ActivationMethod method, const std::string& model = "mitchell_schaeffer", double dx = 1,
                 const Vector& size_mm = {10, 4, 2}, const std::vector<Vector>& probes_mm = {},
                 Stimulus::Kind stimulus = Stimulus::Kind::box, bool beats = false) {
    scene.geometry = GeometryKind::box;
    scene.cell_model = model;
    scene.activation_method = method;
    scene.activation.emplace().beats = beats;
    for (size_t p = 0; p < probes_mm.size(); ++p)
      scene.activation->probes.emplace_back("p").append(std::to_string(p + 1));
    scene.stimuli = {{"corner", stimulus, ""}};
    declare_parameters(scene);
    const char* axes[] = {".x", ".y", ".z"};
    for (size_t a = 0; a < 3; ++a) {
      set(std::string("geometry.box.size_mm") + axes[a], size_mm[a]);
      for (size_t p = 0; p < probes_mm.size(); ++p)
        set("outputs.activation.probes." + scene.activation->probes[p] + "_mm" + axes[a], probes_mm[p][a]);
    }
    set("grid.dx_mm", dx);
    set("time.end_ms", 40);
  }
  void set(const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  }
  Member member(const Changes& changes = {}) const {
    Member result{0, scene.parameters.values()};
    for (const auto& [path, value] : changes)
      result.values[static_cast<size_t>(scene.parameters.index(path))] = value;
    scene.parameters.resolve(result.values);
    return result;
  }
  std::vector<Recording> run(std::vector<Member> members) const {
    for (size_t m = 0; m < members.size(); ++m) members[m].id = static_cast<std::int64_t>(m);
    PlanOptions options;
    options.members_per_device = static_cast<int>(members.size());
    const Plan plan = make_plan(device(), scene, members, options);
    return Simulation(device(), scene, plan).run(members, 600);
  }
};

// The slab of Niederer et al. 2011 at `dx`, its nine points as probes.
Strip niederer_slab(const std::string& model, double dx, bool beats = false) {
  Strip slab(ActivationMethod::reaction_eikonal, model, dx, {20, 7, 3},
             {{0, 0, 0},
              {0, 7, 0},
              {20, 0, 0},
              {20, 7, 0},
              {0, 0, 3},
              {0, 7, 3},
              {20, 0, 3},
              {20, 7, 3},
              {10, 3.5, 1.5}},
             Stimulus::Kind::box, beats);
  slab.set("geometry.fibres.direction.x", 1);
  slab.set("time.end_ms", 60);
  slab.set("electrophysiology.conductivity_longitudinal_mS_per_mm", 0.1334177215);
  slab.set("electrophysiology.conductivity_transverse_mS_per_mm", 0.01760617761);
  return slab;
}

// The first feature whose name begins so.
double feature(const Scene& scene, const Recording& recording, const std::string& prefix) {
  const Layout shape = layout(scene);
  for (size_t k = 0; k < shape.features.size(); ++k)
    if (shape.features[k].starts_with(prefix)) return static_cast<double>(recording.features[k]);
  ADD_FAILURE() << prefix;
  return 0;
}

// Activation at the probes, ms.
std::vector<double> at_probes(const Scene& scene, const Recording& recording) {
  EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
  std::vector<double> result;
  for (const std::string& probe : scene.activation->probes)
    result.push_back(feature(scene, recording, "activation_" + probe + "_ms"));
  return result;
}

// The parts of the solver that reaction-eikonal activation needs, with `members` on them.
struct Assembled {
  Assembled(const Scene& scene, const std::vector<Member>& members)
      : grid(make_grid(scene, members)),
        definitions(scene_definitions(scene, grid)),
        launcher(device(), scene.precision),
        tissue(launcher, scene, grid, static_cast<int>(members.size())),
        diffusion(launcher, scene, definitions),
        monodomain(launcher, scene, definitions, static_cast<int>(members.size())),
        reaction_eikonal(launcher, scene, definitions, static_cast<int>(members.size())) {
    std::vector<double> values;
    for (const Member& member : members)
      values.insert(values.end(), member.values.begin(), member.values.end());
    const std::vector<std::byte> packed = pack(values, scene.precision);
    parameters = device().allocate(packed.size());
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    tissue.build(parameters, static_cast<int>(members.size()));
    tissue.build_fibres(parameters);
    monodomain.assemble(tissue, diffusion, parameters, members);
    reaction_eikonal.assemble(tissue, monodomain, parameters, members);
  }
  void march(double dt_ms, double end_ms) {
    monodomain.initialise(tissue, parameters, dt_ms, 1);
    for (int step = 0; step * dt_ms < end_ms; ++step) {
      reaction_eikonal.trigger(tissue, monodomain, parameters, step * dt_ms, dt_ms);
      monodomain.advance(tissue, parameters, step * dt_ms, step == 0);
    }
  }
  // (stride) single-precision numbers.
  std::vector<float> read(const cl::Buffer& buffer) {
    std::vector<float> result(static_cast<size_t>(tissue.stride));
    launcher.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, result.size() * sizeof(float), result.data());
    return result;
  }

  Grid grid;
  Definitions definitions;
  Launcher launcher;
  Tissue tissue;
  Diffusion diffusion;
  Monodomain monodomain;
  ReactionEikonal reaction_eikonal;
  cl::Buffer parameters;
};

// A stronger stimulus activates no later, also where the front comes before a whole trigger has been.
TEST(ReactionEikonal, EarlierFrontsTriggerNoLater) {
  for (const char* model : {"mitchell_schaeffer", "ten_tusscher_panfilov"}) {
    const Strip strip(ActivationMethod::reaction_eikonal, model);
    std::vector<Member> members;
    const double amplitudes[] = {36, 100, 200, 400, 1000};
    for (const double amplitude : amplitudes)
      members.push_back(strip.member({{"stimuli.corner.amplitude_mV_per_ms", amplitude},
                                      {"stimuli.corner.duration_ms", amplitude < 200 ? 2 : 0.5}}));
    const std::vector<Recording> recordings = strip.run(members);
    double before_first = 1e9, before_last = 1e9;
    for (size_t m = 0; m < recordings.size(); ++m) {
      ASSERT_EQ(recordings[m].outcome, Outcome::done) << recordings[m].reason;
      const double first = feature(strip.scene, recordings[m], "activation_first_"),
                   last = feature(strip.scene, recordings[m], "activation_last_");
      std::printf("%s, %g mV/ms: first activation %.3f ms, last %.3f, steps of %.3f\n", model, amplitudes[m],
                  first, last, recordings[m].dt_ms);
      EXPECT_LE(first, before_first + 0.05);
      EXPECT_LE(last, before_last + 0.05);
      before_first = first;
      before_last = last;
    }
    // As of the same stimulus when there is time for a whole trigger.
    const std::vector<Recording> later =
        strip.run({strip.member({{"stimuli.corner.amplitude_mV_per_ms", 1000},
                                 {"stimuli.corner.duration_ms", 0.5},
                                 {"stimuli.corner.start_ms", 7}})});
    std::printf("  with time for it: %.3f, last %.3f\n",
                feature(strip.scene, later[0], "activation_first_") - 7,
                feature(strip.scene, later[0], "activation_last_") - 7);
    EXPECT_NEAR(before_first, feature(strip.scene, later[0], "activation_first_") - 7, 0.3);
    EXPECT_NEAR(before_last, feature(strip.scene, later[0], "activation_last_") - 7, 0.3);
  }
}

// Triggers end with the longest train of the batch, not with the sum of all.
TEST(ReactionEikonal, TriggersEndWithTheLongestTrain) {
  const Strip strip(ActivationMethod::reaction_eikonal);
  const auto last_ms = [&](const std::vector<Member>& members) {
    return Assembled(strip.scene, members).reaction_eikonal.last_ms();
  };
  const auto train = [&](double period_ms, double count) {
    return strip.member({{"stimuli.corner.period_ms", period_ms}, {"stimuli.corner.count", count}});
  };
  const double once = last_ms({strip.member()});
  EXPECT_GT(once, 5);
  EXPECT_LT(once, 100);
  EXPECT_NEAR(last_ms({train(300, 5), train(200, 4), train(300, 2)}), once + 1200, 1e-6);
}

// Where the threshold lies above the action potential nothing can be triggered: no flat recording.
TEST(ReactionEikonal, RejectsCellsThatNothingTriggers) {
  const Strip strip(ActivationMethod::reaction_eikonal);
  const std::vector<Recording> recordings =
      strip.run({strip.member(), strip.member({{"electrophysiology.activation_threshold_mV", 60}})});
  EXPECT_EQ(recordings[0].outcome, Outcome::done) << recordings[0].reason;
  ASSERT_EQ(recordings[1].outcome, Outcome::rejected);
  EXPECT_NE(recordings[1].reason.find("activation_threshold_mV"), std::string::npos) << recordings[1].reason;
}

// A cell crosses the threshold when the front arrives: to a step where no neighbour lifts it beside the
// trigger.
TEST(ReactionEikonal, TriggersEndAtTheThreshold) {
  for (const char* model : {"mitchell_schaeffer", "ten_tusscher_panfilov"}) {
    const std::string ep = "electrophysiology.";
    const Strip strip(ActivationMethod::reaction_eikonal, model);
    const Member member = strip.member({{ep + "conductivity_longitudinal_mS_per_mm", 0},
                                        {ep + "conductivity_transverse_mS_per_mm", 0},
                                        {ep + "velocity_longitudinal_mm_per_ms", 0.5},
                                        {ep + "velocity_transverse_mm_per_ms", 0.23},
                                        {"stimuli.corner.start_ms", 4}});
    Assembled parts(strip.scene, {member});
    constexpr double dt_ms = 0.02;
    parts.march(dt_ms, 45);
    const std::vector<float> arrival = parts.read(parts.reaction_eikonal.arrival()),
                             activation = parts.read(parts.monodomain.activation());
    double earliest = 0, latest = 0;
    int cells = 0;
    for (size_t i = 0; i < arrival.size(); ++i) {
      if (parts.tissue.regions[i] == 255) continue;
      ++cells;
      ASSERT_GE(activation[i], 0) << model << ": cell " << i << " is not activated; the front comes at "
                                  << arrival[i];
      const double late = static_cast<double>(activation[i]) - static_cast<double>(arrival[i]);
      earliest = std::min(earliest, late);
      latest = std::max(latest, late);
    }
    std::printf("%s: %d cells activated %+.3f to %+.3f ms after the front arrives\n", model, cells, earliest,
                latest);
    EXPECT_EQ(cells, 80);
    EXPECT_GT(earliest, -2 * dt_ms);
    EXPECT_LT(latest, 2 * dt_ms);
  }
}

TEST(ReactionEikonal, TheStartOfTheStimulusShiftsAll) {
  Strip slab = niederer_slab("mitchell_schaeffer", 1);
  slab.set("time.end_ms", 110);
  constexpr double whole_trigger = 3, later = 7;  // the first so that nothing begins before 0
  const std::vector<Recording> recordings =
      slab.run({slab.member({{"stimuli.corner.start_ms", whole_trigger}}),
                slab.member({{"stimuli.corner.start_ms", whole_trigger + later}})});
  const std::vector<double> first = at_probes(slab.scene, recordings[0]),
                            second = at_probes(slab.scene, recordings[1]);
  for (size_t p = 0; p < first.size(); ++p) EXPECT_NEAR(second[p] - first[p], later, 2e-3) << "p" << p + 1;
}

TEST(ReactionEikonal, ATrainBringsItsBeats) {
  Strip slab = niederer_slab("mitchell_schaeffer", 1, true);
  slab.set("electrophysiology.mitchell_schaeffer.tau_close_ms", 40);  // action potentials of 100 ms
  slab.set("electrophysiology.mitchell_schaeffer.tau_open_ms", 30);
  slab.set("time.end_ms", 600);
  constexpr double period = 180;
  const Recording recording = slab.run({slab.member({{"stimuli.corner.start_ms", 3},
                                                     {"stimuli.corner.period_ms", period},
                                                     {"stimuli.corner.count", 3}})})[0];
  const std::vector<double> first = at_probes(slab.scene, recording);
  for (size_t p = 0; p < first.size(); ++p) {
    const std::string probe = slab.scene.activation->probes[p];
    EXPECT_EQ(feature(slab.scene, recording, "activations_" + probe), 3) << probe;
    const double latest = feature(slab.scene, recording, "activation_latest_" + probe + "_ms");
    EXPECT_NEAR(latest - first[p], 2 * period, 0.3) << probe;
  }
}

// A front that spreads in a circle is slower than a plane one, by D / r: arrival times alone know no
// curvature. Against the monodomain equation on a grid that resolves the front.
TEST(ReactionEikonal, FrontsThatCurveAreSlower) {
  constexpr double near = 4, far = 12;                 // mm from the source in a corner
  constexpr double conductivity = 0.2, D = 0.2 / 1.4;  // mS/mm, mm2/ms
  Conduction conduction(device(), Precision::single_);
  const double speed = conduction.converged({cable_of("mitchell_schaeffer")})[0].speed * std::sqrt(D);
  // How much longer than a plane front the front takes from near to far; by sectors, along an edge and
  // between.
  const auto delays = [&](ActivationMethod method, double dx) {
    Strip sheet(method, "mitchell_schaeffer", dx, {14, 14, dx}, {}, Stimulus::Kind::sphere);
    sheet.set("stimuli.corner.radius_mm", 2);
    sheet.set("time.end_ms", 45);
    for (const char* direction : {"longitudinal", "transverse"})
      sheet.set("electrophysiology.conductivity_" + std::string(direction) + "_mS_per_mm", conductivity);
    std::array<std::array<double, 2>, 2> sum{}, count{};  // by sector, near and far
    TissueFields tissue;
    Observer observer;
    observer.tissue = [&](const TissueFields& fields) { tissue = fields; };
    observer.activation = [&](std::span<const float> activation) {
      for (size_t n = 0; n < activation.size(); ++n) {
        const std::int64_t row = tissue.cells[0], plane = row * tissue.cells[1];
        const double x = tissue.origin_mm[0] + (static_cast<double>(tissue.cell[n] % row) + 0.5) * dx,
                     y = tissue.origin_mm[1] + (static_cast<double>(tissue.cell[n] % plane / row) + 0.5) * dx;
        const double r = std::hypot(x, y), edge = std::min(x, y) / r;
        for (size_t ring = 0; ring < 2; ++ring)
          if (std::abs(r - (ring == 0 ? near : far)) < 1) {
            sum[edge > 0.5][ring] += static_cast<double>(activation[n]) - r / speed;
            count[edge > 0.5][ring] += 1;
          }
      }
    };
    const Member member = sheet.member();
    const Plan plan = make_plan(device(), sheet.scene, {&member, 1}, {});
    Simulation simulation(device(), sheet.scene, plan);
    simulation.observe(observer);
    EXPECT_EQ(simulation.run({&member, 1}, 600)[0].outcome, Outcome::done);
    std::array<double, 2> result{};
    for (size_t sector = 0; sector < 2; ++sector)
      result[sector] = sum[sector][1] / count[sector][1] - sum[sector][0] / count[sector][0];
    return result;
  };
  const auto fine = delays(ActivationMethod::monodomain, 0.125),
             coarse = delays(ActivationMethod::reaction_eikonal, 1);
  for (size_t sector = 0; sector < 2; ++sector) {
    std::printf("%s: from %g to %g mm %.2f ms longer than a plane front, monodomain %.2f\n",
                sector == 0 ? "along the edges" : "between", near, far, coarse[sector], fine[sector]);
    EXPECT_GT(fine[sector], 0.7);  // to first order D / speed^2 log(far / near), 0.94 ms
    EXPECT_NEAR(coarse[sector], fine[sector], 0.3);
  }
}

// A member's bits are its own, whichever speeds, steps and trains run beside it.
TEST(ReactionEikonal, AMembersBytesDoNotDependOnItsBatch) {
  const std::string ep = "electrophysiology.";
  Strip slab = niederer_slab("mitchell_schaeffer", 1, true);
  slab.set("time.end_ms", 90);
  const std::vector<Member> members = {
      slab.member(),
      slab.member(
          {{ep + "velocity_longitudinal_mm_per_ms", 1.1}, {ep + "velocity_transverse_mm_per_ms", 0.7}}),
      slab.member(
          {{ep + "conductivity_transverse_mS_per_mm", 0.1}, {ep + "mitchell_schaeffer.tau_out_ms", 5}}),
      slab.member({{ep + "mitchell_schaeffer.tau_in_ms", 0.1}}),
      slab.member({{"stimuli.corner.start_ms", 5}, {"stimuli.corner.upper_mm.x", 3}})};
  const std::vector<Recording> together = slab.run(members);
  std::vector<Recording> alone;
  for (const Member& member : members) alone.push_back(slab.run({member})[0]);
  for (size_t m = 0; m < members.size(); ++m) {
    ASSERT_EQ(alone[m].outcome, Outcome::done) << alone[m].reason;
    ASSERT_EQ(together[m].outcome, Outcome::done) << together[m].reason;
    EXPECT_EQ(together[m].dt_ms, alone[m].dt_ms);
    ASSERT_EQ(together[m].features.size(), alone[m].features.size());
    EXPECT_EQ(std::memcmp(together[m].features.data(), alone[m].features.data(),
                          alone[m].features.size() * sizeof(float)),
              0)
        << m;
    for (size_t n = 0; n < m; ++n)
      EXPECT_NE(at_probes(slab.scene, alone[n]), at_probes(slab.scene, alone[m]));
  }
}

// What the plan prints is what the equation conducts with.
TEST(Plan, VelocitiesAreThoseOfTheEquation) {
  const auto printed = [](const Strip& strip) {
    return make_plan(device(), strip.scene, {}, {}).conduction.at(0).along_mm_per_ms;
  };
  const std::string ep = "electrophysiology.";
  // Niederer's conductivities in series, 0.17 and 0.62 mS/mm: 0.1334.
  Strip monodomain(ActivationMethod::monodomain, "mitchell_schaeffer", 0.5),
      bidomain(ActivationMethod::bidomain, "mitchell_schaeffer", 0.5);
  monodomain.set(ep + "conductivity_longitudinal_mS_per_mm", 0.17 * 0.62 / (0.17 + 0.62));
  EXPECT_NEAR(printed(bidomain), printed(monodomain), 1e-6);
  const double slow = printed(bidomain);
  bidomain.set(ep + "extracellular_longitudinal_mS_per_mm", 0.31);
  EXPECT_NEAR(printed(bidomain) / slow, std::sqrt(0.31 / (0.17 + 0.31) / (0.62 / (0.17 + 0.62))), 1e-6);

  for (const Strip* strip : {&monodomain, &bidomain})
    EXPECT_LT(strip->scene.parameters.find(ep + "velocity_longitudinal_mm_per_ms"), 0);
  EXPECT_LT(bidomain.scene.parameters.find(ep + "conductivity_longitudinal_mS_per_mm"), 0);

  // Left open, a scene that sets velocities is solved by what takes them; also where only some member does.
  Strip open(ActivationMethod::automatic, "mitchell_schaeffer", 0.25);
  EXPECT_EQ(make_plan(device(), open.scene, {}, {}).activation, ActivationMethod::monodomain);
  const std::vector<Member> members = {open.member(),
                                       open.member({{ep + "velocity_longitudinal_mm_per_ms", 3}})};
  EXPECT_EQ(make_plan(device(), open.scene, members, {}).activation, ActivationMethod::reaction_eikonal);
  open.set(ep + "velocity_longitudinal_mm_per_ms", 3);
  const Plan plan = make_plan(device(), open.scene, {}, {});
  EXPECT_EQ(plan.activation, ActivationMethod::reaction_eikonal);
  EXPECT_NEAR(plan.conduction.at(0).along_mm_per_ms, 3, 1e-9);
}

TEST(ReactionEikonal, NiedererSlabAtOneMillimetre) {
  // The monodomain equation of this program, converged: configs/niederer.yaml with grid.dx_mm 0.05
  // (time.dt_ms 0.005) and 0.025 (0.01, with substeps below that) on an H200, extrapolated with order 2. At
  // the far corner 42.82 and 42.41 ms. Uncertain by 0.2 ms across the fibres, where the order observed
  // is 1.6.
  const double converged[] = {1.22, 26.38, 31.60, 41.28, 8.24, 27.81, 32.82, 42.28, 19.54};
  constexpr double published_far_corner = 42.75, published_tolerance = 1;  // Niederer et al. 2011, converged
  const Strip slab = niederer_slab("ten_tusscher_panfilov", 1);
  const Recording recording = slab.run({slab.member()})[0];
  std::printf("%.2f s, of which set-up %.2f s\n", recording.wall_s, recording.setup_s);
  const std::vector<double> activation = at_probes(slab.scene, recording);
  for (size_t p = 0; p < activation.size(); ++p) {
    std::printf("p%zu: %.2f ms, converged monodomain %.2f, %+.2f\n", p + 1, activation[p], converged[p],
                activation[p] - converged[p]);
    EXPECT_NEAR(activation[p], converged[p], 1.5);
  }
  EXPECT_NEAR(activation[7], published_far_corner, 1.5 + published_tolerance);
}

}  // namespace
}  // namespace cohort::test
