#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "ensemble/config.hpp"

// Every file of tests/bad_configs is refused with exactly the messages that its "# expect:" lines hold, given
// the overrides of its "# set:" lines. Files with a "# program:" line are for tests/robustness/bad_inputs.py.
namespace {

struct BadConfig {
  std::string file;
  std::vector<std::string> expected, overrides;
  bool for_program = false;
};

/// What GoogleTest prints of a failing case.
std::ostream& operator<<(std::ostream& stream, const BadConfig& config) {
  return stream << config.file;
}

BadConfig read_expectations(const std::filesystem::path& path) {
  BadConfig config;
  config.file = "tests/bad_configs/" + path.filename().string();
  const auto after = [](const std::string& line, const std::string& word) {
    return line.starts_with(word) ? line.substr(word.size()) : std::string();
  };
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) {
    if (const std::string message = after(line, "# expect: "); !message.empty())
      config.expected.push_back(message.starts_with("--set:") ? message : config.file + ":" + message);
    if (const std::string assignment = after(line, "# set: "); !assignment.empty())
      config.overrides.push_back(assignment);
    if (line.starts_with("# program:")) config.for_program = true;
  }
  return config;
}

std::vector<BadConfig> all_bad_configs() {
  std::vector<BadConfig> configs;
  for (const auto& entry : std::filesystem::directory_iterator(COHORT_SOURCE_DIR "/tests/bad_configs")) {
    if (entry.path().extension() != ".yaml") continue;
    BadConfig config = read_expectations(entry.path());
    if (!config.for_program) configs.push_back(std::move(config));
  }
  std::sort(configs.begin(), configs.end(), [](const auto& a, const auto& b) { return a.file < b.file; });
  return configs;
}

class BadConfigs : public testing::TestWithParam<BadConfig> {};

TEST_P(BadConfigs, AreRefusedWithTheirMessages) {
  const BadConfig& config = GetParam();
  EXPECT_FALSE(config.expected.empty()) << config.file << " has no \"# expect:\" line";
  std::filesystem::current_path(COHORT_SOURCE_DIR);
  try {
    cohort::read_campaign(config.file, config.overrides);
    FAIL() << config.file << " was accepted";
  } catch (const cohort::ConfigError& error) {
    EXPECT_EQ(error.mistakes(), config.expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Files, BadConfigs, testing::ValuesIn(all_bad_configs()), [](const auto& test) {
  return std::filesystem::path(test.param.file).stem().string();
});

TEST(BadConfigFolder, TheFolderHoldsEveryKindOfMistake) {
  EXPECT_GE(all_bad_configs().size(), 50u);
}

TEST(CampaignFile, AFileThatIsNotThereIsNamed) {
  try {
    cohort::read_campaign("tests/nowhere.yaml");
    FAIL();
  } catch (const cohort::ConfigError& error) {
    EXPECT_STREQ(error.what(), "tests/nowhere.yaml: cannot be read: No such file or directory");
  }
}

}  // namespace
