#include "ensemble/store.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>

#include "ensemble/hdf5.hpp"
#include "ensemble/status.hpp"
#include "tests/robustness/fake_campaign.hpp"

namespace cohort {
namespace {

namespace fs = std::filesystem;

class StoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("store_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = folder_ / "a.h5";
  }
  void TearDown() override { fs::remove_all(folder_); }

  static Schema schema(std::int64_t members, std::uint64_t seed = 7, Layout layout = fake::layout()) {
    auto campaign = fake::campaign(members, seed);
    campaign.study = {std::vector<std::string>(static_cast<std::size_t>(members), "corners"),
                      std::vector<std::uint8_t>(static_cast<std::size_t>(members), 1)};
    return make_schema(campaign, sample(campaign), std::move(layout), "test");
  }
  void create(const Schema& s) {
    Claims claims(path_);
    ASSERT_TRUE(create_store(path_, s, claims));
  }
  template <typename Action>
  static std::string error_of(Action action) {
    try {
      action();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
  std::vector<fs::path> temporaries() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_))
      if (entry.path().string().find(".creating.") != std::string::npos) found.push_back(entry.path());
    return found;
  }
  template <typename T>
  T read(const Store& store, Column column, std::size_t row) const {
    T value{};
    const auto at = store.offset(column) + static_cast<off_t>(row * store.row_bytes(column));
    EXPECT_EQ(pread(store.file(), &value, sizeof value, at), static_cast<ssize_t>(sizeof value));
    return value;
  }
  template <typename T>
  std::vector<T> row(const Store& store, Column column, std::size_t index) const {
    std::vector<T> values(store.row_bytes(column) / sizeof(T));
    const auto at = store.offset(column) + static_cast<off_t>(index * store.row_bytes(column));
    EXPECT_EQ(pread(store.file(), values.data(), store.row_bytes(column), at),
              static_cast<ssize_t>(store.row_bytes(column)));
    return values;
  }
  void flip_a_bit(off_t offset) {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(offset);
    const char byte = static_cast<char>(file.get() ^ 0x10);
    file.seekp(offset);
    file.put(byte);
  }

  fs::path folder_, path_;
};

TEST_F(StoreTest, IsCreatedWholeWithEveryMemberQueued) {
  const auto s = schema(10);
  create(s);
  EXPECT_TRUE(temporaries().empty());
  const Store store(path_);
  EXPECT_EQ(store.statuses(), std::vector<Status>(10, Status::queued));
  EXPECT_EQ(store.campaign(), s.campaign);
  EXPECT_EQ(store.sha256(), s.sha256);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(read<double>(store, Column::parameters, i), s.samples.physical[2 * i]);
    EXPECT_EQ(read<double>(store, Column::unit_parameters, i), s.samples.unit[2 * i]);
    for (const auto column :
         {Column::ecg, Column::pv_pressure, Column::pv_volume, Column::displacement, Column::features})
      for (const float number : row<float>(store, column, i)) EXPECT_TRUE(std::isnan(number));
    EXPECT_TRUE(std::isnan(read<double>(store, Column::wall_s, i)));
  }
  EXPECT_EQ(read<double>(store, Column::time_ecg_ms, 7), 7);
  EXPECT_EQ(read<double>(store, Column::time_pv_ms, 7), 14);
  EXPECT_EQ(read<double>(store, Column::time_displacement_ms, 2), 20);
}

TEST_F(StoreTest, DatasetsBeginOnPagesAndDoNotOverlap) {
  create(schema(10));
  std::vector<std::pair<off_t, off_t>> extents;
  for (const char* group : {"", checks_group}) {
    const Store store(path_, Store::Access::read, group);
    for (std::size_t i = 0; i < column_count; ++i) {
      const auto column = static_cast<Column>(i);
      if (store.rows(column) == 0) continue;
      EXPECT_EQ(store.offset(column) % 4096, 0) << group << column_specs[i].path;
      extents.emplace_back(
          store.offset(column),
          store.offset(column) + static_cast<off_t>(store.rows(column) * store.row_bytes(column)));
    }
  }
  EXPECT_GT(extents.size(), column_count);
  std::sort(extents.begin(), extents.end());
  EXPECT_GT(extents.front().first, 0);
  for (std::size_t i = 1; i < extents.size(); ++i) EXPECT_LE(extents[i - 1].second, extents[i].first);
  EXPECT_LE(extents.back().second, static_cast<off_t>(fs::file_size(path_)));
}

TEST_F(StoreTest, EveryByteIsAllocated) {
  create(schema(10));
  struct stat status;
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_GE(status.st_blocks * 512, status.st_size);
}

TEST_F(StoreTest, TakesACampaignLongerThanAnObjectHeader) {
  auto s = schema(2);
  s.campaign = std::string(300000, '#') + "\n\xC2\xB5";
  create(s);
  EXPECT_EQ(Store(path_).campaign(), s.campaign);
}

TEST_F(StoreTest, WhatIsNotRecordedIsNotThere) {
  auto layout = fake::layout();
  layout.leads.clear();
  layout.ecg_ms.clear();
  layout.compartments.clear();
  layout.points.clear();
  const auto s = schema(4, 7, layout);
  create(s);
  Store store(path_, Store::Access::write);
  EXPECT_NO_THROW(store.require(s));
  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  for (const auto column : {Column::ecg, Column::pv_pressure, Column::pv_volume, Column::displacement,
                            Column::time_ecg_ms, Column::time_pv_ms, Column::time_displacement_ms})
    EXPECT_EQ(store.rows(column), 0u) << spec(column).path;
  for (const char* path : {"/ecg", "/pv", "/displacement", "/time/pv_ms"})
    EXPECT_LE(H5Lexists(file, path, H5P_DEFAULT), 0) << path;
  H5Fclose(file);
  Recording recording;
  recording.outcome = Outcome::done;
  recording.features = {1, 2};
  store.commit(std::vector{store.prepare(1, s.samples, recording, {})});
  EXPECT_TRUE(store.row_is_intact(1));
}

TEST_F(StoreTest, ACampaignOfOneHasNoParameters) {
  auto campaign = fake::campaign(1);
  campaign.parameters.clear();
  const auto s = make_schema(campaign, sample(campaign), fake::layout(), "test");
  create(s);
  Store store(path_, Store::Access::write);
  EXPECT_NO_THROW(store.require(s));
  store.commit(std::vector{store.prepare(0, s.samples, fake::simulate(members(campaign)[0], s.layout), {})});
  EXPECT_TRUE(store.row_is_intact(0));
}

TEST_F(StoreTest, ARowComesBackAsItWasCommitted) {
  const auto s = schema(4);
  create(s);
  Store store(path_, Store::Access::write);
  const auto recording = fake::simulate(members(fake::campaign(4))[2], s.layout);
  store.commit(std::vector{
      store.prepare(2, s.samples, recording,
                    {.attempts = 2, .halvings = 1, .crashes = 1, .rank = 3, .device = "a device"})});
  EXPECT_EQ(store.statuses(), (std::vector{Status::queued, Status::queued, Status::done, Status::queued}));
  EXPECT_EQ(row<float>(store, Column::ecg, 2), recording.ecg);
  EXPECT_EQ(row<float>(store, Column::pv_pressure, 2), recording.pressure);
  EXPECT_EQ(row<float>(store, Column::pv_volume, 2), recording.volume);
  EXPECT_EQ(row<float>(store, Column::displacement, 2), recording.displacement);
  const auto account = store.account(2);
  EXPECT_EQ(account.attempts, 2);
  EXPECT_EQ(account.halvings, 1);
  EXPECT_EQ(row<double>(store, Column::step_factor, 2), std::vector<double>{0.5});
  EXPECT_EQ(account.crashes, 1);
  EXPECT_EQ(account.rank, 3);
  EXPECT_EQ(account.device, "a device");
  EXPECT_TRUE(store.row_is_intact(2));
}

TEST_F(StoreTest, SeriesHaveTheirShapesNamesAndUnits) {
  create(schema(4));
  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  using Texts = std::vector<std::string>;
  const auto expect = [&](const char* path, const std::vector<hsize_t>& shape, const std::string& unit,
                          const char* attribute, const Texts& names) {
    const hid_t dataset = H5Dopen2(file, path, H5P_DEFAULT);
    const hid_t space = H5Dget_space(dataset);
    std::vector<hsize_t> extents(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, extents.data(), nullptr);
    EXPECT_EQ(extents, shape) << path;
    EXPECT_EQ(hdf5::read_text(dataset, "units"), unit) << path;
    EXPECT_EQ(hdf5::read_texts(dataset, attribute), names) << path;
    H5Sclose(space);
    H5Dclose(dataset);
  };
  expect("/pv/pressure", {4, 2, 20}, "mmHg", "compartments", {"LV", "aorta"});
  expect("/pv/volume", {4, 2, 20}, "mL", "compartments", {"LV", "aorta"});
  expect("/displacement", {4, 1, 3, 3}, "mm", "points", {"apex"});
  H5Fclose(file);
}

TEST_F(StoreTest, AReasonIsCutBetweenCharacters) {
  const auto s = schema(1);
  create(s);
  Store store(path_, Store::Access::write);
  Recording recording;
  recording.reason = std::string(reason_bytes - 1, 'x') + "\xC3\xA9";
  store.commit(std::vector{store.prepare(0, s.samples, recording, {})});
  EXPECT_EQ(store.reason(0), std::string(reason_bytes - 1, 'x'));
  EXPECT_EQ(store.status(0), Status::failed);
}

TEST_F(StoreTest, RefusesARecordingOfAnotherShape) {
  const auto s = schema(1);
  create(s);
  Store store(path_, Store::Access::write);
  Recording recording;
  recording.ecg.resize(7);
  EXPECT_THROW(store.prepare(0, s.samples, recording, {}), std::logic_error);
}

TEST_F(StoreTest, VerifyFindsASpoiltRowInEveryColumnItCovers) {
  const auto s = schema(6);
  create(s);
  const auto all = members(fake::campaign(6));
  for (const auto column :
       {Column::parameters, Column::ecg, Column::pv_pressure, Column::pv_volume, Column::displacement,
        Column::features, Column::reason, Column::dt_ms, Column::seed}) {
    {
      Store store(path_, Store::Access::write);
      std::vector<RowImage> rows;
      for (const auto& member : all)
        rows.push_back(store.prepare(member.id, s.samples, fake::simulate(member, s.layout), {}));
      store.commit(rows);
    }
    EXPECT_EQ(verify_command(path_), 0);
    const Store store(path_);
    const auto spoilt = store.offset(column) + 3 * static_cast<off_t>(store.row_bytes(column)) + 1;
    flip_a_bit(spoilt);
    EXPECT_FALSE(store.row_is_intact(3));
    EXPECT_EQ(verify_command(path_), 3) << spec(column).path;
    for (int i = 0; i < 6; ++i) EXPECT_EQ(store.status(i) == Status::queued, i == 3);
    if (column == Column::seed) break;
    flip_a_bit(spoilt);
  }
}

TEST_F(StoreTest, VerifyFindsASpoiltStatus) {
  const auto s = schema(2);
  create(s);
  Store store(path_, Store::Access::write);
  const auto all = members(fake::campaign(2));
  store.commit(std::vector{store.prepare(0, s.samples, fake::simulate(all[0], s.layout), {})});
  store.set_status(0, Status::failed);
  EXPECT_EQ(verify_command(path_), 3);
  EXPECT_EQ(store.status(0), Status::queued);
}

TEST_F(StoreTest, IsNotCreatedTwice) {
  create(schema(4));
  Claims claims(path_);
  EXPECT_FALSE(create_store(path_, schema(4), claims));
}

TEST_F(StoreTest, RefusesAnotherCampaignNamingBothChecksums) {
  create(schema(4, 7));
  const auto error = error_of([&] { Store(path_, Store::Access::write).require(schema(4, 8)); });
  EXPECT_NE(error.find("sha256-of-4-7"), std::string::npos) << error;
  EXPECT_NE(error.find("sha256-of-4-8"), std::string::npos) << error;
  EXPECT_NE(error.find("its text is in the file's attribute `campaign`"), std::string::npos) << error;
}

TEST_F(StoreTest, RefusesAnotherShape) {
  create(schema(4));
  const auto error = error_of([&] { Store(path_).require(schema(4, 7, fake::layout(201))); });
  EXPECT_NE(error.find("/ecg"), std::string::npos) << error;
}

TEST_F(StoreTest, RefusesWhatIsNoStore) {
  EXPECT_NE(error_of([&] { Store{path_}; }).find("cannot be opened"), std::string::npos);
  std::ofstream(path_) << "not HDF5";
  EXPECT_NE(error_of([&] { Store{path_}; }).find("not a cohort file (it is not HDF5)"), std::string::npos);
  const hid_t file = H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(file);
  EXPECT_NE(error_of([&] { Store{path_}; }).find("not a cohort file (HDF5, but"), std::string::npos);
}

TEST_F(StoreTest, RefusesAFolderThatDoesNotExist) {
  const auto error = error_of([&] {
    const auto path = folder_ / "nowhere" / "a.h5";
    Claims claims(path);
    create_store(path, schema(1), claims);
  });
  EXPECT_NE(error.find("nowhere"), std::string::npos) << error;
}

TEST_F(StoreTest, RefusesWhatTheDiskCannotHoldBeforeItWritesAnything) {
  auto s = schema(1);
  s.members = std::int64_t{1} << 34;  // 9600 bytes of ECG each: 150 TiB
  Claims claims(path_);
  const auto error = error_of([&] { create_store(path_, s, claims); });
  EXPECT_NE(error.find("no space left on the disk"), std::string::npos) << error;
  EXPECT_NE(error.find("bytes"), std::string::npos) << error;
  EXPECT_FALSE(fs::exists(path_));
  EXPECT_TRUE(temporaries().empty());
}

TEST_F(StoreTest, AReservationThatFailsLeavesNothing) {
  // A limit on the size of files stands in for a disk that fills up after the room on it was asked for.
  rlimit before;
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{.rlim_cur = 100000, .rlim_max = before.rlim_max};
  signal(SIGXFSZ, SIG_IGN);
  Claims claims(path_);
  setrlimit(RLIMIT_FSIZE, &small);
  const auto error = error_of([&] { create_store(path_, schema(64), claims); });
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_NE(error.find("cannot be created: File too large"), std::string::npos) << error;
  EXPECT_FALSE(fs::exists(path_));
  EXPECT_TRUE(temporaries().empty());
}

TEST_F(StoreTest, RemovesWhatAKilledCreationLeft) {
  std::ofstream(path_.string() + ".creating.elsewhere.123") << "half";
  std::ofstream(folder_ / "b.h5.creating.elsewhere.124") << "another store's";
  create(schema(4));
  ASSERT_EQ(temporaries().size(), 1u);
  EXPECT_EQ(temporaries()[0].filename(), "b.h5.creating.elsewhere.124");
}

TEST_F(StoreTest, KeepsThePerformanceOfAProcess) {
  create(schema(4));
  Store store(path_, Store::Access::write);
  store.write_performance(2, {.kernels = {{"reaction", 10, 1.5, 4096}, {"diffusion", 20, 2.5, 8192}},
                              .device = "a device",
                              .triad_GB_per_s = 12.5,
                              .simulated_ms = 800,
                              .cell_updates = 1e9,
                              .wall_s = 3});
  EXPECT_EQ(read<double>(store, Column::triad, 2), 12.5);
  EXPECT_EQ(read<std::int64_t>(store, Column::calls, 2), 10);
  EXPECT_EQ((read<std::array<double, 2>>(store, Column::device_ms, 2)), (std::array{1.5, 2.5}));
  EXPECT_STREQ((read<std::array<char, kernel_name_bytes>>(store, Column::kernels, 2).data()), "reaction");
  EXPECT_TRUE(std::isnan(read<double>(store, Column::triad, 1)));
}

}  // namespace
}  // namespace cohort
