// What every scene of configs/ takes of a device: kernels, programs, launches, memory.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "ensemble/members.hpp"
#include "solver/trial.hpp"
#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

using Overrides = std::vector<std::string>;

const Overrides one_beat = {"grid.dx_mm=6", "mechanics.dx_mm=8", "torso.dx_mm=20", "time.beats.at_most=1",
                            "time.beats.length_ms=300"};

/// Small enough for seconds: coarse grids and short times.
const std::map<std::string, Overrides> scenes = {
    {"arostica", {"grid.dx_mm=8", "time.end_ms=20"}},
    {"bidomain", {"grid.dx_mm=1", "time.end_ms=5"}},
    {"cell", {"time.end_ms=20"}},
    {"circulation", {"time.beats.at_most=3"}},
    {"demo", one_beat},
    {"ecg", {"grid.dx_mm=6", "torso.dx_mm=20", "time.end_ms=200"}},
    {"ecg_campaign", {"grid.dx_mm=6", "torso.dx_mm=20", "time.end_ms=200"}},
    {"eikonal", {"grid.dx_mm=6", "torso.dx_mm=20", "time.end_ms=200"}},
    {"electromechanics", {"grid.dx_mm=1", "time.end_ms=5"}},
    {"heart", one_beat},
    {"labels", {"grid.dx_mm=6", "torso.dx_mm=20", "time.end_ms=200"}},
    {"labels_heart", one_beat},
    {"land_contraction", {"grid.dx_mm=2"}},
    {"land_inflation", {"grid.dx_mm=2"}},
    {"niederer", {"grid.dx_mm=1", "time.end_ms=5"}},
    {"reentry", {"grid.dx_mm=4", "time.end_ms=20"}},
    {"restitution", {"grid.dx_mm=0.5", "time.end_ms=20"}},
    {"shapes", {"grid.dx_mm=4", "time.end_ms=20"}},
    {"slab", {"grid.dx_mm=1", "time.end_ms=5"}},
    {"speed", {"grid.dx_mm=6", "time.end_ms=20"}},
    {"speed_cells", {"grid.dx_mm=4", "time.end_ms=5"}},
    {"whole_heart", one_beat},
    {"windkessel", {"grid.dx_mm=6", "mechanics.dx_mm=8", "time.beats.at_most=1", "time.beats.length_ms=300"}},
};

/// Kernels that a scene builds and does not launch, with the reason; of any scene.
const std::map<std::string, std::string> idle_with_reason = {
    {"add_correction", "V-cycles alone, by which tests look at the multigrid"},
    {"torso_inclusions", "only where a member's lungs or blood conduct differently, which may be sampled"},
    {"eikonal_trigger", "only where something starts waves at points"},
    {"eikonal_fire", "only where something starts waves at points"},
    {"recorded_arrival", "only where activation times are asked for, or cells deform"},
    {"injected_source", "only where a current is injected at the boundary, whose amplitude may be sampled"},
    {"eikonal_slow", "only where a passive region lies beside the front"},
    {"eikonal_sheet_metric", "only with a conduction system"},
    {"eikonal_normals", "only with a conduction system"},
};

struct Row {
  std::size_t kernels = 0, launched = 0;
  int programs = 0;
  double launches_per_step = 0;
  std::int64_t launches = 0;  ///< of a member, its set-up and solvers too
  std::size_t bytes = 0;
  std::set<std::string> idle;
  std::set<std::string> uncalled_for;  ///< kernels of modules that the plan leaves out
  double stated_bytes = 0;
  std::string by_module;  ///< bytes stated and taken
};

std::size_t settled_bytes() {
  device().queue().finish();
  for (std::size_t bytes = device().allocated_bytes();;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const std::size_t now = device().allocated_bytes();
    if (now == bytes) return now;
    bytes = now;
  }
}

Row row_of(const std::string& name) {
  const Campaign campaign = campaign_of(name + ".yaml", scenes.at(name));
  const Scene& scene = campaign.scene;
  const std::vector<Member> all = members(campaign);
  const std::span<const Member> one(all.data(), 1);
  PlanOptions options;
  options.members_per_device = 1;
  const Plan plan = make_plan(device(), scene, one, options);
  Row row;
  row.launches_per_step = try_out(device(), scene, plan, one, 0).launches_per_step;
  row.stated_bytes = static_cast<double>(plan.bytes);
  const std::size_t before = settled_bytes();
  device().restart_footprint();
  {
    Simulation simulation(device(), scene, plan);
    const Recording recording = simulation.run(one, 600).front();
    EXPECT_EQ(recording.outcome, Outcome::done) << name << ": " << recording.reason;
  }
  const Footprint footprint = device().footprint();
  row.kernels = footprint.kernels.size();
  row.programs = footprint.programs;
  row.launches = footprint.launches();
  row.bytes = footprint.peak_bytes - before;
  const auto runs = [&](const std::string& module) {
    return std::any_of(plan.modules.begin(), plan.modules.end(),
                       [&](const PlannedModule& m) { return m.name == module && m.runs; });
  };
  for (const Footprint::Kernel& kernel : footprint.kernels) {
    if (kernel.launches == 0) {
      row.idle.insert(kernel.name);
      continue;
    }
    ++row.launched;
    const std::string module = module_of(kernel.file);
    // The drive's columns are those of templates.
    if (!module.empty() && !runs(module) && !(module == "templates" && runs("tension drive")))
      row.uncalled_for.insert(kernel.name + " of " + module);
  }
  std::map<std::string, std::size_t> taken;
  for (const Footprint::Buffer& buffer : footprint.buffers) taken[module_of(buffer.file)] += buffer.bytes;
  for (const PlannedModule& module : plan.modules)
    row.by_module += module.name + ": " + std::to_string(module.bytes) + " stated, " +
                     std::to_string(taken[module.name]) + " taken\n";
  row.by_module += "others: " + std::to_string(taken[""]) + "\n";
  for (const Footprint::Buffer& buffer : footprint.buffers)
    if (buffer.bytes * 20 > row.bytes)
      row.by_module += buffer.name + " of " + buffer.file + ": " + std::to_string(buffer.bytes) + "\n";
  return row;
}

std::map<std::string, Row> reference() {
  std::ifstream file(std::string(COHORT_SOURCE_DIR) + "/tests/reference/footprint.csv");
  std::map<std::string, Row> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::string name;
    Row row;
    words >> name >> row.kernels >> row.launched >> row.programs >> row.launches_per_step >> row.bytes >>
        row.launches;
    rows[name] = row;
  }
  return rows;
}

std::string joined(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text;
}

class OfScene : public testing::TestWithParam<std::string> {};

// On a CPU: vectors are narrower on a GPU and so are rows of templates.
TEST_P(OfScene, TakesNoMoreThanItDid) {
  if (device().info().gpu) GTEST_SKIP() << "the table is that of a CPU";
  const std::string& name = GetParam();
  // What a driver gives back late counts as taken: of a few runs the least is the scene's.
  Row row = row_of(name);
  for (int again = 0; again < 10 && static_cast<double>(row.bytes) > row.stated_bytes; ++again)
    row.bytes = std::min(row.bytes, row_of(name).bytes);
  // tests/reference/make_footprint.sh reads these lines.
  std::printf("row %s,%zu,%zu,%d,%.2f,%zu,%lld\n", name.c_str(), row.kernels, row.launched, row.programs,
              row.launches_per_step, row.bytes, static_cast<long long>(row.launches));
  std::set<std::string> unexplained;
  for (const std::string& kernel : row.idle)
    if (!idle_with_reason.contains(kernel)) unexplained.insert(kernel);
  EXPECT_TRUE(unexplained.empty()) << "built and never launched: " << joined(unexplained);
  EXPECT_TRUE(row.uncalled_for.empty()) << "launched, and left out by the plan: " << joined(row.uncalled_for);
  const double stated = static_cast<double>(row.bytes) / row.stated_bytes;
  std::printf("%s: %.3f of the bytes that the plan states\n", name.c_str(), stated);
  if (stated < 0.95 || stated > 1) std::printf("%s", row.by_module.c_str());
  EXPECT_GE(stated, 0.95) << "the plan states more than is taken";
  EXPECT_LE(stated, 1.0) << "the plan states less than is taken";
  const std::map<std::string, Row> rows = reference();
  ASSERT_TRUE(rows.contains(name)) << "no row in tests/reference/footprint.csv: make_footprint.sh makes it";
  const Row& known = rows.at(name);
  EXPECT_LE(row.kernels, known.kernels);
  EXPECT_LE(row.launched, known.launched);
  EXPECT_LE(row.programs, known.programs);
  EXPECT_LE(row.launches_per_step, known.launches_per_step + 0.01);
  // Iterations of solvers and steps of tissue differ a little between devices.
  EXPECT_LE(static_cast<double>(row.launches), 1.05 * static_cast<double>(known.launches));
  EXPECT_LE(static_cast<double>(row.bytes), 1.05 * static_cast<double>(known.bytes));
}

std::vector<std::string> names() {
  std::vector<std::string> result;
  for (const auto& [name, overrides] : scenes) result.push_back(name);
  return result;
}

INSTANTIATE_TEST_SUITE_P(Footprint, OfScene, testing::ValuesIn(names()),
                         [](const auto& scene) { return scene.param; });

TEST(Footprint, KnowsEveryFileOfConfigs) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(COHORT_SOURCE_DIR) + "/configs"))
    if (entry.path().extension() == ".yaml") files.insert(entry.path().stem().string());
  std::set<std::string> known;
  for (const auto& [name, overrides] : scenes) known.insert(name);
  EXPECT_EQ(files, known);
}

}  // namespace
}  // namespace cohort::test
