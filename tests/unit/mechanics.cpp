// What a scene with mechanics declares, and what is refused before it runs.
#include "solver/simulation.hpp"
#include "tests/laws.hpp"

namespace cohort::test {
namespace {

TEST(Mechanics, DeclaresItsParameters) {
  Scene scene;
  scene.geometry = GeometryKind::heart;
  scene.circulation = Circulation{};
  scene.mechanics =
      Mechanics{.law = "guccione",
                .tension = "twitch",
                .cavities = {{"lv", ""}, {"rv", ""}},
                .boundary = {{"floor", "base", Mechanics::Boundary::Kind::clamp_normal},
                             {"ring", "base", Mechanics::Boundary::Kind::spring},
                             {"pericardium", "epicardium", Mechanics::Boundary::Kind::spring_normal}}};
  declare_parameters(scene);
  const auto value = [&](const char* path) { return scene.parameters.value(path); };
  EXPECT_EQ(value("mechanics.guccione.C_kPa"), 4);
  EXPECT_EQ(value("mechanics.boundary.ring.stiffness_kPa_per_mm"), 0.5);
  EXPECT_EQ(value("mechanics.boundary.pericardium.stiffness_kPa_per_mm"), 0.1);
  EXPECT_EQ(scene.parameters.find("mechanics.boundary.floor.stiffness_kPa_per_mm"), -1);
  EXPECT_EQ(value("mechanics.inflation.rv_pressure_mmHg"), 1.5);
  EXPECT_EQ(scene.parameters.find("mechanics.cavities.lv.pressure_kPa"), -1);
  // Own values of a region inherit, and stand in a row as M expects them.
  std::vector<double> values = scene.parameters.values();
  values[static_cast<std::size_t>(scene.parameters.index("mechanics.regions.rv.peak_kPa"))] = 90;
  scene.parameters.resolve(values);
  const MechanicsText text = mechanics_text(scene);
  const std::size_t of_rv = static_cast<std::size_t>(scene.parameters.index("mechanics.regions.rv.C_kPa"));
  EXPECT_EQ(values[of_rv], 4);
  EXPECT_NE(text.generated.find("#define M_peak_kPa 4\n"), std::string::npos);
  EXPECT_EQ(values[of_rv + 4], 90);
  EXPECT_NE(text.generated.find("#define M_viscosity_kPa_ms 14\n"), std::string::npos);
  EXPECT_EQ(scene.parameters[static_cast<int>(of_rv) + 14].path, "mechanics.regions.rv.viscosity_kPa_ms");
  EXPECT_EQ(scene.regions[1].name, "rv");
  const std::string table = text.generated.substr(text.generated.find("material_first"));
  EXPECT_NE(table.find(", " + std::to_string(of_rv) + ", "), std::string::npos);
}

// Every law with every tension: no name twice in a region.
TEST(Mechanics, JoinsEveryLawWithEveryTension) {
  for (const std::string& law : laws())
    for (const std::string& tension : tensions())
      EXPECT_NO_THROW(solid_box(law, tension, "ten_tusscher_panfilov")) << law << " " << tension;
}

TEST(Mechanics, RefusesWhatThereIsNot) {
  const auto message = [](const std::string& law, const std::string& tension) -> std::string {
    try {
      solid_box(law, tension);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(message("rubber", ""), "no \"rubber\" in kernels/laws");
  EXPECT_EQ(message("guccione", "springs"), "no \"springs\" in kernels/tension");
  EXPECT_EQ(
      message("guccione", "calcium"),
      "mechanics.tension: calcium is driven by intracellular calcium, which cell model mitchell_schaeffer of "
      "region \"tissue\" does not have");
}

TEST(Mechanics, PlansNoUnstableSolid) {
  Scene scene = solid_box("mooney_rivlin");
  scene.activation = ActivationRequest{};
  const auto c2 = static_cast<std::size_t>(scene.parameters.index("mechanics.mooney_rivlin.c2_kPa"));
  const auto plan_of = [&](const std::vector<double>& second) {
    std::vector<Member> members;
    for (const double c : second) {
      members.push_back({static_cast<std::int64_t>(members.size()), scene.parameters.values()});
      members.back()
          .values[static_cast<std::size_t>(scene.parameters.index("mechanics.mooney_rivlin.c1_kPa"))] = 0.5;
      members.back().values[c2] = c;
      scene.parameters.resolve(members.back().values);
    }
    return make_plan(device(), scene, members, {});
  };
  try {
    plan_of({-0.7, -0.8});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()),
              "mechanics.mooney_rivlin: region \"tissue\": the law mooney_rivlin is unstable at rest: its "
              "shear modulus, 2 (c1_kPa + "
              "c2_kPa), is -0.4 "
              "kPa; it must be positive");
  }
  EXPECT_NO_THROW(plan_of({-0.7, 0.8}));  // one is rejected when its turn comes
}

}  // namespace
}  // namespace cohort::test
