// Cell parameters that vary through the wall: their values against exact coordinates, and what they do to the
// action potential against tissue that has the same value throughout.
#include <cmath>
#include <cstdio>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Set = std::vector<std::pair<std::string, double>>;
const std::string ep = "electrophysiology.", slope = ep + "heterogeneity.";

// A spherical shell about the origin, 3 to 8 mm: the transmural coordinate is exactly (r - 3) / 5.
constexpr double inner_mm = 3, outer_mm = 8;

Scene shell(const std::string& model, Precision precision, const std::vector<std::string>& varying) {
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.shapes = {{"outside", Shape::Kind::ellipsoid, {}},
                  {"inside", Shape::Kind::ellipsoid, {}},
                  {"wall", Shape::Kind::subtract, {"outside", "inside"}}};
  scene.regions = {{.name = "wall", .shape = "wall", .fibres = Region::Fibres::transmural}};
  scene.cell_model = model;
  scene.precision = precision;
  scene.heterogeneity.parameters = varying;
  return scene;
}

Set shell_values(double dx_mm, Set more) {
  Set result = {{"grid.dx_mm", dx_mm},
                {ep + "conductivity_longitudinal_mS_per_mm", 0},
                {ep + "conductivity_transverse_mS_per_mm", 0}};
  for (const char* axis : {".x", ".y", ".z"}) {
    result.emplace_back(std::string("geometry.shapes.outside.ellipsoid.semi_axes_mm") + axis, outer_mm);
    result.emplace_back(std::string("geometry.shapes.inside.ellipsoid.semi_axes_mm") + axis, inner_mm);
  }
  result.insert(result.end(), more.begin(), more.end());
  return result;
}

double transmural(const std::array<double, 3>& p) {
  return std::clamp((std::hypot(p[0], p[1], p[2]) - inner_mm) / (outer_mm - inner_mm), 0.0, 1.0);
}

TEST(Heterogeneity, AddsSlopesToTheRegionsValueWithinItsRange) {
  // The resting potential can be read from the tissue at its start.
  const std::string rest = slope + "resting_mV.";
  Slab slab(shell("mitchell_schaeffer", Precision::double_, {"resting_mV"}),
            shell_values(1, {{ep + "regions.wall.resting_mV", -90},
                             {rest + "transmural", 50},
                             {rest + "endocardial", -20},
                             {rest + "midmyocardial", 2},
                             {rest + "epicardial", 3},
                             {slope + "endocardial_until", 0.25},
                             {slope + "epicardial_from", 0.6}}));
  slab.monodomain->initialise(*slab.tissue, slab.parameters, 0.05, 1);
  const std::vector<double> V = slab.potential();
  int cells = 0, at_bound = 0, layers[3] = {0, 0, 0};
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const double u = transmural(p);
    const int layer = u < 0.25 ? 0 : u < 0.6 ? 1 : 2;
    const double exact = std::max(-90 + 50 * (u - 0.5) + (layer == 0 ? -20 : layer == 1 ? 2 : 3), -120.0);
    ++cells;
    ++layers[layer];
    at_bound += exact == -120;
    EXPECT_NEAR(V[i], exact, 1e-9) << "u " << u;
  });
  EXPECT_GT(cells, 1000);
  EXPECT_GT(at_bound, 20);
  for (const int count : layers) EXPECT_GT(count, 50);
}

TEST(Heterogeneity, OfTheHeartFollowsItsCoordinatesInTheVentriclesAlone) {
  Scene heart;
  heart.cell_model = "mitchell_schaeffer";
  heart.region_cell_models = {{"rv", "ten_tusscher_panfilov"}};
  heart.precision = Precision::double_;
  heart.heterogeneity.parameters = {"resting_mV"};
  const std::string rest = slope + "resting_mV.";
  Slab slab(std::move(heart), {{"grid.dx_mm", 5},
                               {rest + "transmural", 3},
                               {rest + "apico_basal", 5},
                               {rest + "lateral", 2},
                               {rest + "anterior", -1.5}});
  slab.monodomain->initialise(*slab.tissue, slab.parameters, 0.05, 1);
  const std::vector<double> V = slab.potential();
  const auto n = static_cast<std::size_t>(slab.tissue->stride);
  const std::vector<double> coordinates = slab.read(slab.tissue->coordinates, 4 * n);
  int counted[3] = {0, 0, 0};
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const std::string& region = slab.scene.regions[slab.tissue->regions[i]].name;
    const double base = region == "rv" ? -85.23 : -85;
    if (region != "lv" && region != "rv") {
      ++counted[2];
      EXPECT_NEAR(V[i], base, 1e-12) << region;
      return;
    }
    ++counted[region == "rv"];
    // The axis is z and the angle that around it, with the apex 90 mm below the base.
    const double around = std::hypot(p[0], p[1]), u = coordinates[i], a = (p[2] + 90) / 90;
    EXPECT_NEAR(V[i], base + 3 * (u - 0.5) + 5 * (a - 0.5) + 2 * p[0] / around - 1.5 * p[1] / around, 1e-6)
        << region;
  });
  for (const int count : counted) EXPECT_GT(count, 50);
}

TEST(Heterogeneity, TheFastestCellSetsTheStep) {
  constexpr double tau_in = 0.3, tau_out = 6, change = -0.3;
  Slab slab(shell("mitchell_schaeffer", Precision::double_, {"tau_in_ms"}),
            shell_values(1, {{slope + "tau_in_ms.transmural", change}}));
  double fastest = 0;
  slab.each_cell([&](std::size_t, const std::array<double, 3>& p) {
    fastest = std::max(fastest, 1 / (tau_in + change * (transmural(p) - 0.5)) + 1 / tau_out);
  });
  EXPECT_GT(fastest, 1.7 * (1 / tau_in + 1 / tau_out));
  EXPECT_NEAR(slab.monodomain->fastest_rate()[0], fastest, 1e-9 * fastest);
}

// By cell: time from a kick to v = 0.5 until v falls through v_gate, linear between samples of 1 ms.
std::vector<double> durations(Slab& slab) {
  constexpr double resting = -85, amplitude = 105, v_gate = 0.13, dt = 0.05, end = 500;
  constexpr int steps_a_sample = 20;
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  slab.write(slab.monodomain->potential(),
             slab.field([](auto...) { return resting + 0.5 * amplitude; }, resting));
  std::vector<double> before = slab.potential(), result(before.size(), -1);
  for (int step = 0; step * dt < end;) {
    for (int k = 0; k < steps_a_sample; ++k, ++step)
      slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == 0);
    const std::vector<double> now = slab.potential();
    constexpr double gate = resting + amplitude * v_gate;
    for (std::size_t i = 0; i < now.size(); ++i)
      if (before[i] >= gate && now[i] < gate)
        result[i] = step * dt - dt * steps_a_sample * (gate - now[i]) / (before[i] - now[i]);
    before = now;
  }
  return result;
}

TEST(Heterogeneity, DurationsFollowTheGatesTimeConstant) {
  // Mitchell & Schaeffer 2003: the duration is tau_close ln(1 / h_min) to leading order, h_min = 4 tau_in /
  // tau_out. What the full equations add, 43.27 ms at tau_close 150 ms
  // (tests/reference/mitchell_schaeffer.yaml), is the slow passage of a fold that is left at a rate 1 /
  // tau_close, and so goes with its cubic root.
  constexpr double h_min = 4 * 0.3 / 6, tau_close = 150, change = -60, passage = 43.27;
  Slab slab(shell("mitchell_schaeffer", Precision::double_, {"tau_close_ms"}),
            shell_values(1, {{slope + "tau_close_ms.transmural", change}}));
  const std::vector<double> duration = durations(slab);
  const auto uniform = [&](double tau) {
    Slab cell({8, 1, 1}, 1, Precision::double_, "mitchell_schaeffer",
              {{ep + "mitchell_schaeffer.tau_close_ms", tau}});
    const std::vector<double> all = durations(cell);
    double found = 0;
    cell.each_cell([&](std::size_t i, const auto&) { found = all[i]; });
    return found;
  };
  double endo = 0, epi = 0, u_endo = 1, u_epi = 0;
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const double u = transmural(p);
    if (u < u_endo) u_endo = u, endo = duration[i];
    if (u > u_epi) u_epi = u, epi = duration[i];
  });
  const auto predicted = [&](double u) {
    const double tau = tau_close + change * (u - 0.5);
    return tau * std::log(1 / h_min) + passage * std::cbrt(tau / tau_close);
  };
  const double difference = predicted(u_endo) - predicted(u_epi);
  std::printf("u %.3f: %.2f ms, u %.3f: %.2f ms; difference %.2f ms, predicted %.2f ms\n", u_endo, endo,
              u_epi, epi, endo - epi, difference);
  EXPECT_GT(u_epi - u_endo, 0.8);
  EXPECT_NEAR(endo, uniform(tau_close + change * (u_endo - 0.5)), 1e-6);
  EXPECT_NEAR(epi, uniform(tau_close + change * (u_epi - 0.5)), 1e-6);
  EXPECT_NEAR(endo - epi, difference, 0.5);
}

TEST(Heterogeneity, LayersOfTenTusscherCellsAreThoseOfThePaper) {
  // ten Tusscher & Panfilov 2006: gKs 0.098 in the mid-myocardium, gto 0.073 and the other s gate in the
  // endocardium.
  const std::string model = "ten_tusscher_panfilov";
  Slab wall(shell(model, Precision::double_, {"gKs", "gto", "endocardial"}),
            shell_values(1, {{slope + "gKs.midmyocardial", -0.294},
                             {slope + "gto.endocardial", -0.221},
                             {slope + "endocardial.endocardial", 1}}));
  constexpr double dt = 0.05, end = 300;
  const auto run = [&](Slab& slab) {
    slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
    slab.write(slab.monodomain->potential(), slab.field([](auto...) { return 20; }, -85.23));
    for (int step = 0; step * dt < end; ++step)
      slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == 0);
    return slab.potential();
  };
  const std::string root = ep + model + ".";
  const std::vector<Set> layers = {
      {{root + "gto", 0.073}, {root + "endocardial", 1}}, {{root + "gKs", 0.098}}, {}};
  std::vector<double> alone;
  for (const Set& layer : layers) {
    Slab cell({8, 1, 1}, 1, Precision::double_, model, layer);
    const std::vector<double> V = run(cell);
    cell.each_cell([&](std::size_t i, const auto&) {
      if (cell.tissue->centre(i)[0] < 1) alone.push_back(V[i]);
    });
  }
  ASSERT_EQ(alone.size(), 3u);
  std::printf("300 ms after a kick: endocardium %.3f mV, mid-myocardium %.3f mV, epicardium %.3f mV\n",
              alone[0], alone[1], alone[2]);
  EXPECT_GT(alone[1] - alone[2], 5);
  EXPECT_GT(std::abs(alone[0] - alone[2]), 0.1);
  const std::vector<double> V = run(wall);
  int counted[3] = {0, 0, 0};
  wall.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const double u = transmural(p);
    const int layer = u < 1.0 / 3 ? 0 : u < 2.0 / 3 ? 1 : 2;
    ++counted[layer];
    EXPECT_NEAR(V[i], alone[static_cast<std::size_t>(layer)], 1e-6) << "u " << u;
  });
  for (const int count : counted) EXPECT_GT(count, 50);
}

}  // namespace
}  // namespace cohort::test
