// Several cell models in one heart: cells of a region behave, bit for bit, as in a tissue that has their
// model throughout, whatever stands beside them in a vector; waves pass from one model to another.
#include <cmath>
#include <cstdio>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Set = std::vector<std::pair<std::string, double>>;
const std::string ms = "mitchell_schaeffer", tt = "ten_tusscher_panfilov";

// Two blocks along x from 0 to `first_mm` and from `second_mm` to `end_mm`, dx 1 mm or so: regions "left" and
// "right".
struct Blocks {
  double first_mm, second_mm, end_mm, dx_mm;

  Scene scene(const std::string& model, const std::map<std::string, std::string>& of_regions,
              Precision precision) const {
    Scene result;
    result.geometry = GeometryKind::shapes;
    result.shapes = {{"left_block", Shape::Kind::box, {}}, {"right_block", Shape::Kind::box, {}}};
    result.regions = {{.name = "left", .shape = "left_block"}, {.name = "right", .shape = "right_block"}};
    result.cell_model = model;
    result.region_cell_models = of_regions;
    result.precision = precision;
    return result;
  }
  Set sizes() const {
    const double width = 2 * dx_mm;
    Set result = {{"grid.dx_mm", dx_mm}};
    const auto box = [&](const std::string& name, double from, double to) {
      const std::string root = "geometry.shapes." + name + ".box.";
      result.insert(result.end(), {{root + "centre_mm.x", (from + to) / 2},
                                   {root + "centre_mm.y", width / 2},
                                   {root + "centre_mm.z", width / 2},
                                   {root + "size_mm.x", to - from},
                                   {root + "size_mm.y", width},
                                   {root + "size_mm.z", width}});
    };
    box("left_block", 0, first_mm);
    box("right_block", second_mm, end_mm);
    return result;
  }
};

void start(Slab& slab, double dt, const std::function<bool(double)>& raised) {
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  std::vector<double> V = slab.potential();
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    if (raised(p[0])) V[i] = 20;
  });
  slab.write(slab.monodomain->potential(), V);
}

void march(Slab& slab, double dt, double from_ms, double until_ms) {
  for (auto step = static_cast<int>(std::lround(from_ms / dt)); step * dt < until_ms - dt / 2; ++step)
    slab.monodomain->advance(*slab.tissue, slab.parameters, step * dt, step == 0);
}

std::vector<std::vector<double>> everything(Slab& slab, std::size_t states) {
  std::vector<std::vector<double>> fields = {slab.potential()};
  const auto stride = static_cast<std::size_t>(slab.tissue->stride);
  for (std::size_t k = 0; k < states; ++k)
    fields.push_back(slab.read(slab.monodomain->states(), stride, k * stride));
  return fields;
}

// Blocks with a gap of one cell between them, in the middle of a segment of 8 cells.
constexpr Blocks apart = {3, 4, 15, 1};

void expect_same_bits(Precision precision, const Set& set, const Set& left_alone, const Set& right_alone) {
  const auto joined = [](Set a, const Set& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  Slab mixed(apart.scene(ms, {{"right", tt}}, precision), joined(apart.sizes(), set));
  Slab left(apart.scene(ms, {}, precision), joined(apart.sizes(), left_alone));
  Slab right(apart.scene(tt, {}, precision), joined(apart.sizes(), right_alone));
  const std::size_t ms_states = read_cell_model(ms).states.size(),
                    tt_states = read_cell_model(tt).states.size();
  constexpr double dt = 0.02, end = 30;
  const auto raised = [](double x) { return x < 2 || x > 13; };
  for (Slab* slab : {&mixed, &left, &right}) {
    start(*slab, dt, raised);
    march(*slab, dt, 0, end);
  }
  const auto all = everything(mixed, tt_states), left_all = everything(left, ms_states),
             right_all = everything(right, tt_states);
  std::size_t compared[2] = {0, 0}, segments_with_both = 0;
  double moved[2] = {0, 0};
  for (std::size_t s = 0; s < mixed.tissue->regions.size(); s += Tissue::lanes) {
    bool has[2] = {false, false};
    for (std::size_t i = s; i < s + Tissue::lanes; ++i) {
      const std::uint8_t region = mixed.tissue->regions[i];
      if (region == 255) continue;
      has[region] = true;
      ++compared[region];
      const auto& alone = region == 0 ? left_all : right_all;
      for (std::size_t k = 0; k < alone.size(); ++k)
        ASSERT_EQ(all[k][i], alone[k][i]) << "field " << k << " cell " << i;
      moved[region] = std::max(moved[region], std::abs(all[0][i] + 85));
    }
    segments_with_both += has[0] && has[1];
  }
  EXPECT_EQ(compared[0], 3u * 4);
  EXPECT_EQ(compared[1], 11u * 4);
  EXPECT_EQ(segments_with_both, 4u);
  for (const double mV : moved) EXPECT_GT(mV, 50) << "no action potential";
}

TEST(SeveralModels, ARegionsCellsHaveTheBitsOfTissueWithTheirModelAlone) {
  for (const Precision precision : {Precision::single_, Precision::double_})
    expect_same_bits(precision, {}, {}, {});
}

TEST(SeveralModels, DerivedConstantsThatAreFieldsToo) {
  // Regions that differ from their model's own values: derived constants become fields.
  const std::string regions = "electrophysiology.regions.";
  expect_same_bits(Precision::single_, {{regions + "left.tau_close_ms", 120}, {regions + "right.gKs", 0.098}},
                   {{regions + "left.tau_close_ms", 120}}, {{regions + "right.gKs", 0.098}});
}

TEST(SeveralModels, EachStartsAtItsOwnRest) {
  Slab slab(apart.scene(ms, {{"right", tt}}, Precision::double_), apart.sizes());
  slab.monodomain->initialise(*slab.tissue, slab.parameters, 0.02, 1);
  const std::vector<double> V = slab.potential();
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    EXPECT_NEAR(V[i], p[0] < 3.5 ? -85 : -85.23,
                1e-12);  // Mitchell-Schaeffer's and Niederer et al. 2011, table
  });
}

TEST(SeveralModels, TheFastestSetsTheStep) {
  const auto rate = [](const std::string& model, const std::map<std::string, std::string>& of_regions) {
    return Slab(apart.scene(model, of_regions, Precision::single_), apart.sizes())
        .monodomain->fastest_rate()[0];
  };
  const double slow = rate(ms, {}), fast = rate(tt, {});
  EXPECT_NE(slow, fast);
  EXPECT_EQ(rate(ms, {{"right", tt}}), std::max(slow, fast));
  EXPECT_EQ(rate(tt, {{"right", ms}, {"left", ms}}), slow);  // a model that no region has has no say
}

// All models in one program, side by side in one vector: each rises through the common activation threshold.
TEST(SeveralModels, AllOfThemTogetherPassTheActivationThreshold) {
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.activation.emplace();
  Set values = {{"grid.dx_mm", 1},
                {"electrophysiology.conductivity_longitudinal_mS_per_mm", 0},
                {"electrophysiology.conductivity_transverse_mS_per_mm", 0}};
  int count = 0;
  for (const std::string& model : cell_models()) {
    if (model == "pathmanathan_gray") continue;  // dimensionless, for verification only
    std::string name = "r";
    name += std::to_string(count);
    const std::string root = "geometry.shapes." + name + ".box.";
    scene.shapes.push_back({name, Shape::Kind::box, {}});
    scene.regions.push_back({.name = name, .shape = name});
    scene.region_cell_models[name] = model;
    for (const char* axis : {".x", ".y", ".z"})
      values.insert(values.end(), {{root + "centre_mm" + axis, 0.5}, {root + "size_mm" + axis, 1}});
    values[values.size() - 6].second = count + 0.5;
    ++count;
  }
  ASSERT_GE(count, 6);
  Slab slab(std::move(scene), values);
  constexpr double dt = 0.02;
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  slab.write(slab.monodomain->potential(), slab.field([](auto...) { return -20; }, -85));
  march(slab, dt, 0, 10);
  std::vector<float> times(static_cast<std::size_t>(slab.tissue->stride));
  slab.launcher->queue().enqueueReadBuffer(slab.monodomain->activation(), CL_TRUE, 0,
                                           times.size() * sizeof(float), times.data());
  int cells = 0;
  slab.each_cell([&](std::size_t i, const auto&) {
    const std::string& region = slab.scene.regions[slab.tissue->regions[i]].name;
    std::printf("%s rises through 0 mV at %.2f ms\n", slab.scene.region_cell_models.at(region).c_str(),
                static_cast<double>(times[i]));
    EXPECT_GT(times[i], 0) << slab.scene.region_cell_models.at(region);
    ++cells;
  });
  EXPECT_EQ(cells, count);
}

// A wave that starts in either block activates the other, in order.
TEST(SeveralModels, WavesPassFromOneModelToTheOther) {
  constexpr Blocks touching = {5, 5, 10, 0.2};
  for (const bool from_left : {true, false}) {
    Scene scene = touching.scene(ms, {{"right", tt}}, Precision::single_);
    scene.activation.emplace();
    Slab slab(std::move(scene), touching.sizes());
    constexpr double dt = 0.02;
    start(slab, dt, [&](double x) { return from_left ? x < 1 : x > 9; });
    march(slab, dt, 0, 60);
    std::vector<float> times(static_cast<std::size_t>(slab.tissue->stride));
    slab.launcher->queue().enqueueReadBuffer(slab.monodomain->activation(), CL_TRUE, 0,
                                             times.size() * sizeof(float), times.data());
    double near_ms = -1, interface_ms = -1, far_ms = -1;
    slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
      const double run = from_left ? p[0] : 10 - p[0];
      if (std::abs(run - 2.1) < 0.01) near_ms = static_cast<double>(times[i]);
      if (std::abs(run - 5.1) < 0.01) interface_ms = static_cast<double>(times[i]);
      if (std::abs(run - 9.9) < 0.01) far_ms = static_cast<double>(times[i]);
    });
    std::printf("from the %s: 2.1 mm at %.2f ms, 5.1 mm at %.2f ms, 9.9 mm at %.2f ms\n",
                from_left ? "left" : "right", near_ms, interface_ms, far_ms);
    EXPECT_GT(near_ms, 0);
    EXPECT_GT(interface_ms, near_ms);
    EXPECT_GT(far_ms, interface_ms);
  }
}

}  // namespace
}  // namespace cohort::test
