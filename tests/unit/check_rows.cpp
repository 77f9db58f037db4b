// Checks and errors in the store, with a simulator that only adds.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <set>

#include "ensemble/choose_checks.hpp"
#include "ensemble/error_estimate.hpp"
#include "ensemble/hdf5.hpp"
#include "ensemble/run_checks.hpp"
#include "ensemble/status.hpp"
#include "tests/robustness/fake_campaign.hpp"

namespace cohort {
namespace {

namespace fs = std::filesystem;

class Checks : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("checks_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = folder_ / "a.h5";
    campaign_.check_fraction = 0.2;
    schema_ = make_schema(campaign_, sample(campaign_), layout_, "test");
    all_ = members(campaign_, schema_.samples);
    fine_ = fine_campaign(campaign_.scene, all_, campaign_.scene.activation_method);
    Claims claims(path_);
    create_store(path_, schema_, claims);
    store_ = std::make_unique<Store>(path_, Store::Access::write);
    checks_ = std::make_unique<Store>(path_, Store::Access::write, checks_group);
    store_->require(schema_);
    checks_->require(checks_schema(schema_));
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// What goes wrong stays within the first few members.
  RunBatch members_without(const std::set<std::int64_t>& failing) {
    return [=, this](std::span<const Member> batch, double) {
      std::vector<Recording> recordings;
      for (const auto& member : batch) {
        recordings.push_back(fake::simulate({40, member.values}, layout_));
        if (failing.contains(member.id)) recordings.back() = failed("made to fail");
      }
      return recordings;
    };
  }
  static Recording failed(const std::string& reason) {
    Recording recording;
    recording.outcome = Outcome::unstable;
    recording.reason = reason;
    return recording;
  }
  /// Fine: feature 0 less a hundredth of itself, feature 1 less an eighth.
  RunBatch fine_without(const std::set<std::int64_t>& failing) {
    return [=, this](std::span<const Member> batch, double timeout_s) {
      EXPECT_EQ(timeout_s, check_cost * WorkerOptions{}.timeout_s);
      auto recordings = members_without(failing)(batch, timeout_s);
      for (std::size_t i = 0; i < batch.size(); ++i) {
        ran_.insert(batch[i].id);
        if (recordings[i].features.empty()) continue;
        recordings[i].features[0] -= 0.01F * recordings[i].features[0];
        recordings[i].features[1] -= 0.125F;  // exact, or the plane would be one of rounding
      }
      return recordings;
    };
  }
  void run_members(const std::set<std::int64_t>& failing = {}, int retries = 0) {
    Claims claims(path_);
    WorkerOptions options;
    options.members_per_device = 4;
    options.retries = retries;
    work(*store_, claims, schema_.samples, all_, members_without(failing), options);
  }
  void run_checks(const std::set<std::int64_t>& failing = {}, int retries = 0) {
    Claims claims(path_, campaign_.members);
    WorkerOptions options;
    options.members_per_device = 3;
    options.retries = retries;
    ran_.clear();
    work_on_checks(*store_, *checks_, claims, schema_, fine_, fine_without(failing), options);
  }
  void write() {
    Claims claims(path_);
    write_errors(*store_, schema_, claims);
  }
  std::int64_t checked(std::size_t check) const { return schema_.checked[check]; }
  std::vector<float> estimate(std::int64_t member) const {
    const auto bytes = store_->read_rows(Column::error_estimate, static_cast<std::size_t>(member), 1);
    std::vector<float> values(bytes.size() / sizeof(float));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  bool is_measured(std::int64_t member) const {
    return store_->read_rows(Column::error_measured, static_cast<std::size_t>(member), 1).front() == 1;
  }
  std::vector<char> bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  fs::path folder_, path_;
  Campaign campaign_ = fake::campaign(60);
  Layout layout_ = fake::layout();
  Schema schema_;
  std::vector<Member> all_;
  FineCampaign fine_;
  std::unique_ptr<Store> store_, checks_;
  std::set<std::int64_t> ran_;
};

TEST_F(Checks, ErrorsAreMeasuredWhereCheckedAndToldElsewhere) {
  run_members();
  EXPECT_EQ(exit_code(*store_), 3);
  run_checks();
  EXPECT_EQ(exit_code(*store_), 0);
  EXPECT_EQ(ran_, std::set(schema_.checked.begin(), schema_.checked.end()));
  EXPECT_FALSE(has_errors(*store_));
  write();
  ASSERT_TRUE(has_errors(*store_) && errors_are_intact(*store_));
  const std::set<std::int64_t> measured(schema_.checked.begin(), schema_.checked.end());
  for (std::int64_t member = 0; member < campaign_.members; ++member) {
    EXPECT_EQ(is_measured(member), measured.contains(member));
    const auto errors = estimate(member);
    // Order 1 doubles a difference. The planted error is a plane in the parameter, not in its place in the
    // cube, where a normal distribution bends it.
    const double value = all_[static_cast<std::size_t>(member)].values[0];
    EXPECT_NEAR(errors[0], 0.02 * value, is_measured(member) ? 1e-5 : 0.01) << member;
    EXPECT_NEAR(errors[1], 0.25, 1e-6);
  }
  const auto features = feature_errors(*store_);
  ASSERT_EQ(features.size(), 2u);
  EXPECT_EQ(features[0].feature, "qrs_ms");
  EXPECT_EQ(features[0].checks, 12);
  EXPECT_EQ(features[0].model, ErrorModelKind::linear);
  EXPECT_LT(features[0].left_out_rms, 0.5 * features[0].left_out_rms_constant);
  EXPECT_EQ(features[1].model, ErrorModelKind::constant);
  EXPECT_NEAR(features[1].mean, 0.25, 1e-6);
  EXPECT_NEAR(features[1].rms, 0.25, 1e-6);
  EXPECT_NEAR(features[1].largest, 0.25, 1e-6);
  EXPECT_NE(status_report(*store_).find("qrs_ms"), std::string::npos);
}

TEST_F(Checks, WritingTwiceChangesNothing) {
  run_members();
  run_checks();
  write();
  const auto before = bytes();
  write();
  EXPECT_EQ(bytes(), before);
  forget_errors(*store_);
  EXPECT_NE(bytes(), before);
  write();
  EXPECT_EQ(bytes(), before);
}

TEST_F(Checks, NothingIsWrittenBeforeAllHasEnded) {
  write();
  EXPECT_FALSE(has_errors(*store_));
  run_members();
  write();
  EXPECT_FALSE(has_errors(*store_));
  EXPECT_TRUE(has_open_checks(*store_, *checks_, schema_, 0));
  run_checks();
  EXPECT_FALSE(has_open_checks(*store_, *checks_, schema_, 0));
}

TEST_F(Checks, AFailedCheckCostsItsOwnErrorAlone) {
  run_members();
  run_checks({checked(2)});
  write();
  EXPECT_EQ(exit_code(*store_), 0);  // the campaign is complete
  EXPECT_EQ(checks_->status(2), Status::unstable);
  EXPECT_NE(status_report(*store_).find("1 x unstable: made to fail (checks 2)"), std::string::npos);
  EXPECT_FALSE(is_measured(checked(2)));
  EXPECT_TRUE(is_measured(checked(1)));
  EXPECT_NEAR(estimate(checked(2))[1], 0.25, 1e-6);
  EXPECT_EQ(feature_errors(*store_)[0].checks, 11);
  // More retries open it again, and what it tells then is told.
  EXPECT_TRUE(has_open_checks(*store_, *checks_, schema_, 1));
  run_checks({}, 1);
  write();
  EXPECT_EQ(ran_, std::set{checked(2)});
  EXPECT_TRUE(is_measured(checked(2)));
  EXPECT_EQ(feature_errors(*store_)[0].checks, 12);
}

TEST_F(Checks, OfAMemberThatIsNotDoneWaitsForIt) {
  run_members({checked(0), checked(3)});
  run_checks();
  write();
  EXPECT_EQ(exit_code(*store_), 2);
  EXPECT_FALSE(ran_.contains(checked(0)) || ran_.contains(checked(3)));
  EXPECT_EQ(checks_->status(0), Status::rejected);
  EXPECT_EQ(checks_->reason(0), nothing_to_compare);
  EXPECT_TRUE(std::isnan(estimate(checked(0))[0]));
  EXPECT_EQ(feature_errors(*store_)[0].checks, 10);
  EXPECT_FALSE(has_open_checks(*store_, *checks_, schema_, 0));
  run_members({}, 1);
  EXPECT_TRUE(has_open_checks(*store_, *checks_, schema_, 0));
  run_checks();
  write();
  EXPECT_EQ(ran_, (std::set{checked(0), checked(3)}));
  EXPECT_EQ(exit_code(*store_), 0);
  EXPECT_EQ(feature_errors(*store_)[0].checks, 12);
  EXPECT_TRUE(is_measured(checked(0)));
}

TEST_F(Checks, OneThatIsDoneTellsOfItsMemberAlone) {
  std::set<std::int64_t> others(schema_.checked.begin(), schema_.checked.end());
  others.erase(checked(4));
  run_members();
  run_checks(others);
  write();
  EXPECT_NEAR(estimate(checked(4))[1], 0.25, 1e-6);
  EXPECT_TRUE(is_measured(checked(4)));
  for (std::int64_t member = 0; member < campaign_.members; ++member) {
    if (member != checked(4)) {
      EXPECT_TRUE(std::isnan(estimate(member)[1]));
    }
  }
  EXPECT_EQ(feature_errors(*store_)[1].model, ErrorModelKind::none);
}

TEST_F(Checks, VerifyFindsASpoiltCheckAndSpoiltErrors) {
  run_members();
  run_checks();
  write();
  const auto whole = bytes();
  const auto flip = [&](const Store& store, Column column) {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(store.offset(column) + 1);
    const char byte = static_cast<char>(file.get() ^ 0x10);
    file.seekp(store.offset(column) + 1);
    file.put(byte);
  };
  EXPECT_EQ(verify_command(path_), 0);
  for (const auto column : {Column::error_estimate, Column::error_measured, Column::error_mean,
                            Column::error_left_out, Column::error_crc32}) {
    flip(*store_, column);
    EXPECT_EQ(verify_command(path_), 3) << spec(column).path;
    EXPECT_FALSE(has_errors(*store_));
    write();
    EXPECT_EQ(bytes(), whole) << spec(column).path;
  }
  flip(*checks_, Column::features);
  EXPECT_EQ(verify_command(path_), 3);
  EXPECT_EQ(checks_->status(0), Status::queued);
  EXPECT_EQ(exit_code(*store_), 3);
  run_checks();
  write();
  EXPECT_EQ(ran_, std::set{checked(0)});
  EXPECT_EQ(verify_command(path_), 0);
}

TEST_F(Checks, ClaimsOfMembersAndChecksAreDifferent) {
  Claims of_members(path_), of_checks(path_, campaign_.members), others(path_, campaign_.members);
  EXPECT_TRUE(of_members.try_claim(0));
  EXPECT_TRUE(of_checks.try_claim(0));
  EXPECT_FALSE(others.try_claim(0));
  of_checks.count_kill(0);
  EXPECT_EQ(of_members.kills(0), 0);
  EXPECT_EQ(others.kills(0), 1);
}

TEST_F(Checks, StandInTheFileWithTheirNames) {
  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  for (const char* path : {"/checks/member", "/checks/features", "/checks/members/reason", "/errors/rms"})
    EXPECT_GT(H5Lexists(file, path, H5P_DEFAULT), 0) << path;
  for (const char* path : {"/member", "/checks/ecg", "/checks/performance", "/checks/time"})
    EXPECT_LE(H5Lexists(file, path, H5P_DEFAULT), 0) << path;
  const hid_t errors = H5Gopen2(file, "/errors", H5P_DEFAULT);
  EXPECT_EQ(hdf5::read_texts(errors, "names"), layout_.features);
  H5Gclose(errors);
  const hid_t model = H5Dopen2(file, "/errors/model", H5P_DEFAULT);
  EXPECT_EQ(hdf5::read_texts(model, "legend"), (std::vector<std::string>{"none", "constant", "linear"}));
  H5Dclose(model);
  H5Fclose(file);
}

TEST(WithoutChecks, ThereIsNothingOfThem) {
  const auto path = fs::path(::testing::TempDir()) / ("without_" + std::to_string(getpid()) + ".h5");
  auto campaign = fake::campaign(20);
  campaign.check_fraction = 0;
  const auto schema = make_schema(campaign, sample(campaign), fake::layout(), "test");
  {
    Claims claims(path);
    create_store(path, schema, claims);
    Store store(path, Store::Access::write);
    store.require(schema);
    EXPECT_FALSE(store.has_checks() || has_errors(store));
    write_errors(store, schema, claims);
    EXPECT_THROW(Store(path, Store::Access::read, checks_group), std::runtime_error);
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    for (const char* name : {"/checks", "/errors", "/members/error_estimate", "/members/error_measured"})
      EXPECT_LE(H5Lexists(file, name, H5P_DEFAULT), 0) << name;
    H5Fclose(file);
  }
  fs::remove(path);
  fs::remove(path.string() + ".claims");
}

}  // namespace
}  // namespace cohort
