#include "solver/nifti.hpp"

#include <gtest/gtest.h>
#include <nifti1.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "solver/distance_transform.hpp"
#include "solver/labels.hpp"

namespace {

using namespace cohort;

std::string temporary(const std::string& name) {
  return (std::filesystem::temp_directory_path() / (std::to_string(getpid()) + "_" + name)).string();
}

/// A sound file of 4 x 3 x 2 voxels of one byte, as bytes, for tests to spoil.
struct File {
  nifti_1_header header{};
  std::vector<unsigned char> voxels = std::vector<unsigned char>(24, 1);

  File() {
    header.sizeof_hdr = 348;
    const short dim[] = {3, 4, 3, 2, 1, 1, 1, 1};
    std::memcpy(header.dim, dim, sizeof(dim));
    for (float& edge : header.pixdim) edge = 1;
    header.datatype = DT_UINT8;
    header.bitpix = 8;
    header.vox_offset = 352;
    header.sform_code = 1;
    header.srow_x[0] = header.srow_y[1] = header.srow_z[2] = 1;
    std::memcpy(header.magic, "n+1", 4);
  }
  std::string write(const std::string& name) const {
    const std::string file = temporary(name);
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(&header), sizeof(header)).write("\0\0\0\0", 4);
    out.write(reinterpret_cast<const char*>(voxels.data()), static_cast<std::streamsize>(voxels.size()));
    return file;
  }
};

std::string refusal(const std::string& file) {
  std::string message = "accepted";
  try {
    read_label_image(file);
  } catch (const std::runtime_error& error) {
    message = error.what();
    EXPECT_TRUE(message.starts_with(file + ": ")) << message;
  }
  std::filesystem::remove(file);
  return message;
}

template <class Spoil>
std::string refusal_of(Spoil spoil, const std::string& name = "spoilt.nii") {
  File file;
  spoil(file);
  return refusal(file.write(name));
}

void expect_says(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(Nifti, ASoundFileIsRead) {
  File file;
  file.voxels[5] = 7;
  const std::string name = file.write("sound.nii");
  const LabelImage image = read_label_image(name);
  std::filesystem::remove(name);
  EXPECT_EQ(image.cells, (std::array<int, 3>{4, 3, 2}));
  EXPECT_EQ(image.labels, (std::vector<std::int32_t>{1, 7}));
  EXPECT_EQ(image.counts, (std::vector<std::int64_t>{23, 1}));
  EXPECT_EQ(image.voxels[5], 1);
}

TEST(Nifti, MalformedFilesAreRefusedWithTheirReason) {
  expect_says(refusal_of([](File& f) { f.voxels.resize(10); }), "is cut short or its header is wrong");
  expect_says(refusal_of([](File& f) { f.header.dim[1] = f.header.dim[2] = f.header.dim[3] = 32767; }),
              "more than 2^31");
  expect_says(refusal_of([](File& f) { f.header.dim[1] = f.header.dim[2] = 20000; }),
              "is cut short or its header is wrong");
  expect_says(refusal_of([](File& f) { f.header.dim[2] = 0; }), "0 voxels along axis 2");
  expect_says(refusal_of([](File& f) { f.header.dim[2] = -3; }), "-3 voxels along axis 2");
  expect_says(refusal_of([](File& f) { f.header.srow_y[1] = std::numeric_limits<float>::quiet_NaN(); }),
              "its sform holds nan");
  expect_says(refusal_of([](File& f) { f.header.srow_z[3] = std::numeric_limits<float>::infinity(); }),
              "its sform holds inf");
  expect_says(refusal_of([](File& f) {
                f.header.srow_y[0] = 1;
                f.header.srow_y[1] = 0;
              }),
              "its sform");
  expect_says(refusal_of([](File& f) {
                f.header.srow_x[1] = 1;
                f.header.srow_y[1] = 0;
                f.header.srow_z[1] = 0;
              }),
              "its sform is singular");
  expect_says(refusal_of([](File& f) { f.header.srow_x[0] = 0; }), "voxels of 0 mm");
  expect_says(refusal_of([](File& f) { f.header.sform_code = 0; }), "neither sform nor qform");
  expect_says(refusal_of([](File& f) { f.header.magic[1] = '?'; }), "its magic is not");
  expect_says(refusal_of([](File& f) { std::memcpy(f.header.magic, "ni1", 4); }), "half of a .hdr/.img pair");
  expect_says(refusal_of([](File& f) {
                f.header.dim[0] = 4;
                f.header.dim[4] = 2;
                f.voxels.resize(48);
              }),
              "4 dimensions");
  expect_says(refusal_of([](File& f) { f.header.dim[0] = 2; }), "has 2 dimensions");
  expect_says(refusal_of([](File& f) {
                f.header.datatype = DT_RGB24;
                f.header.bitpix = 24;
                f.voxels.resize(72);
              }),
              "labels are integers or floats");
  expect_says(refusal_of([](File& f) { f.header.scl_slope = 0.3f; }), "which is no label");
  expect_says(refusal_of([](File& f) { f.header.vox_offset = -4; }), "begins its voxels at byte -4");
  expect_says(refusal_of([](File&) {}, "wrong.img"), "is no NIfTI-1 file by its name");
  const std::string empty = temporary("empty.nii");
  std::ofstream{empty};
  expect_says(refusal(empty), "is empty");
  const std::string text = temporary("text.nii.gz");
  std::ofstream(text) << std::string(1000, 'x');
  expect_says(refusal(text), "is no NIfTI-1 file");
  expect_says(refusal(temporary("absent.nii")), "cannot be read");
}

TEST(Nifti, ATruncatedGzipIsRefused) {
  LabelImage image;
  image.cells = {40, 30, 20};
  image.labels = {0, 3};
  image.voxels.resize(image.size());
  std::mt19937 random(1);
  for (auto& voxel : image.voxels) voxel = random() % 2;
  const std::string name = temporary("cut.nii.gz");
  write_label_image(name, image);
  EXPECT_EQ(read_label_image(name).voxels, image.voxels);
  std::filesystem::resize_file(name, std::filesystem::file_size(name) / 2);
  expect_says(refusal(name), "cut short or damaged");
}

// Whatever a header says the reader ends with an image or with one message: run under AddressSanitizer.
TEST(Nifti, RandomHeadersAreReadOrRefused) {
  std::mt19937 random(7);
  int refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    File file;
    auto* bytes = reinterpret_cast<unsigned char*>(&file.header);
    for (auto flips = 1 + random() % 6; flips > 0; --flips)
      bytes[random() % sizeof(file.header)] = static_cast<unsigned char>(random());
    const std::string name = file.write("fuzz.nii");
    try {
      const LabelImage image = read_label_image(name);
      EXPECT_EQ(image.voxels.size(), image.size());
    } catch (const std::runtime_error&) {
      ++refused;
    }
    std::filesystem::remove(name);
  }
  EXPECT_GT(refused, 300);
  EXPECT_LT(refused, 3000);
}

TEST(Nifti, FloatsSlopesAndBytesInOtherOrderGiveLabels) {
  File file;
  file.header.datatype = DT_FLOAT32;
  file.header.bitpix = 32;
  file.header.scl_slope = 2;
  file.header.scl_inter = 500;
  file.voxels.assign(96, 0);
  const float value = 50;
  std::memcpy(&file.voxels[4 * 9], &value, 4);
  const std::string name = file.write("float.nii");
  const LabelImage image = read_label_image(name);
  std::filesystem::remove(name);
  EXPECT_EQ(image.labels, (std::vector<std::int32_t>{500, 600}));
  EXPECT_EQ(image.voxels[9], 1);
}

TEST(Labels, UnknownValuesAreNamedWithTheirVoxels) {
  LabelImage image;
  image.cells = {4, 1, 1};
  image.labels = {0, 205, 999};
  image.counts = {1, 2, 1};
  image.voxels = {0, 1, 1, 2};
  try {
    const LabelHeart heart(image, "a.nii", "MM-WHS", label_table("MM-WHS"), LabelFrame::image);
    FAIL();
  } catch (const std::invalid_argument& error) {
    expect_says(std::string(error.what()),
                "a.nii: holds labels that convention MM-WHS does not know: 999 (1 voxels)");
  }
}

TEST(DistanceTransform, EqualsTheSearchOverAllSeeds) {
  const std::array<int, 3> n = {13, 9, 11};
  std::mt19937 random(3);
  std::vector<std::uint8_t> seed(size_t(n[0] * n[1] * n[2]));
  for (auto& s : seed) s = random() % 60 == 0;
  const std::vector<float> distance = distance_transform(seed, n);
  const auto place = [&](size_t i) {
    return std::array<int, 3>{int(i) % n[0], int(i) / n[0] % n[1], int(i) / (n[0] * n[1])};
  };
  for (size_t i = 0; i < seed.size(); ++i) {
    double nearest = 1e30;
    for (size_t j = 0; j < seed.size(); ++j)
      if (seed[j])
        nearest = std::min(nearest, std::hypot(place(i)[0] - place(j)[0], place(i)[1] - place(j)[1],
                                               place(i)[2] - place(j)[2]));
    ASSERT_NEAR(distance[i], nearest, 1e-5);
  }
  EXPECT_EQ(distance_transform(std::vector<std::uint8_t>(8, 0), {2, 2, 2})[3], no_seed);
}

}  // namespace
