// The beating heart read back from a label map of itself (configs/labels_heart.yaml) beside that of
// configs/heart.yaml, at 4 mm. A minute or two on a CPU.
#include <unistd.h>

#include <filesystem>

#include "solver/export_labels.hpp"
#include "tests/heart_run.hpp"

namespace cohort::test {
namespace {

TEST(HeartLabels, BeatsAsTheHeartThatItWasMadeOf) {
  const std::string file =
      (std::filesystem::temp_directory_path() / (std::to_string(getpid()) + "_heart.nii.gz")).string();
  const Campaign campaign = read_campaign(COHORT_SOURCE_DIR "/configs/heart.yaml", {at(4)});
  Member member{0, campaign.scene.parameters.values()};
  campaign.scene.parameters.resolve(member.values);
  constexpr double voxel = 0.5;
  write_label_image(file, label_image(device(), campaign.scene, member, voxel));
  const std::vector<std::string> one_beat = {at(4), "time.beats.at_most=1"};
  std::vector<std::string> changes = one_beat;
  changes.push_back("geometry.labels=" + file);
  const Beat map = beat(changes, {}, "labels_heart.yaml")[0];
  std::filesystem::remove(file);
  const Beat heart = beat(one_beat)[0];
  ASSERT_EQ(heart.recording.outcome, Outcome::done) << heart.recording.reason;
  ASSERT_EQ(map.recording.outcome, Outcome::done) << map.recording.reason;
  const auto compare = [&](const char* name, double tolerance) {
    std::printf("%-28s %9.2f  through labels %9.2f\n", name, heart.feature.at(name), map.feature.at(name));
    EXPECT_NEAR(map.feature.at(name), heart.feature.at(name), tolerance) << name;
  };
  for (const char* name : {"lv_edv_mL", "lv_esv_mL", "rv_edv_mL", "rv_esv_mL", "lv_peak_mmHg"})
    compare(name, 0.02 * heart.feature.at(name));
  compare("lv_ef_percent", 1);
  compare("rv_ef_percent", 1);
  compare("lv_ejection_ms", 5);
}

}  // namespace
}  // namespace cohort::test
