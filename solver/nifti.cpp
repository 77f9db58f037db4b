// NIfTI-1 label maps. R. W. Cox et al., "A (sort of) new image data format standard: NIfTI-1", NeuroImage 22
// (2004); field meanings as in the standard's header nifti1.h. Headers and voxels are decoded by niftiio,
// after what it would trust has been checked here.
#include "solver/nifti.hpp"

#include <nifti1_io.h>
#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

namespace cohort {

namespace {

constexpr double smallest_voxel_mm = 0.01, largest_voxel_mm = 50;
constexpr std::int64_t most_voxels = std::int64_t{1} << 31;
constexpr int deflate_ratio = 1032;  // the most that deflate can shrink
constexpr int comment_code = 6;      // NIFTI_ECODE_COMMENT
constexpr double whole_number_tolerance = 1e-3;

struct FreeImage {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
struct FreeHeader {
  void operator()(nifti_1_header* header) const { free(header); }
};

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw std::runtime_error(file + ": " + what);
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// What of a header has to hold before niftiio may act on it.
void check_header(const std::string& file, const nifti_1_header& header, std::uintmax_t file_bytes) {
  if (std::memcmp(header.magic, "n+1", 4) != 0)
    fail(file, std::memcmp(header.magic, "ni1", 4) == 0
                   ? "is half of a .hdr/.img pair; join it to one .nii file"
                   : "is no NIfTI-1 file (its magic is not \"n+1\")");
  const int dimensions = header.dim[0];
  if (dimensions < 1 || dimensions > 7) fail(file, fmt::format("has {} dimensions", dimensions));
  int used = 3;
  for (int d = 4; d <= dimensions; ++d)
    if (header.dim[d] != 1) used = d;
  if (dimensions < 3 || used > 3)
    fail(file, fmt::format("has {} dimensions; a label map has three", dimensions < 3 ? dimensions : used));
  std::int64_t voxels = 1;
  for (int d = 1; d <= 3; ++d) {
    if (header.dim[d] < 1) fail(file, fmt::format("has {} voxels along axis {}", header.dim[d], d));
    voxels *= header.dim[d];  // at most 32767 cubed
  }
  int bytes = 0, swap = 0;
  nifti_datatype_sizes(header.datatype, &bytes, &swap);
  const bool number =
      nifti_is_inttype(header.datatype) || header.datatype == DT_FLOAT32 || header.datatype == DT_FLOAT64;
  const bool colour = header.datatype == DT_RGB24 || header.datatype == DT_RGBA32;
  if (!number || colour || bytes <= 0)
    fail(file, fmt::format("holds voxels of type {}; labels are integers or floats",
                           nifti_datatype_string(header.datatype)));
  if (!std::isfinite(header.vox_offset) || header.vox_offset < 352 || header.vox_offset > 1e9f)
    fail(file, fmt::format("begins its voxels at byte {}", header.vox_offset));
  if (voxels > most_voxels)
    fail(file,
         fmt::format("has {} x {} x {} voxels, more than 2^31", header.dim[1], header.dim[2], header.dim[3]));
  const double needed = static_cast<double>(header.vox_offset) + static_cast<double>(voxels) * bytes;
  const double held = static_cast<double>(file_bytes) * (ends_with(file, ".gz") ? deflate_ratio : 1);
  if (needed > held)
    fail(file,
         fmt::format("is cut short or its header is wrong: {} x {} x {} voxels of {} bytes do not fit in "
                     "{} bytes",
                     header.dim[1], header.dim[2], header.dim[3], bytes, file_bytes));
}

/// Whether the file, decompressed, holds so many bytes and is sound so far; niftiio fills what is missing
/// with zeros.
bool holds(const std::string& file, std::uint64_t bytes) {
  gzFile in = gzopen(file.c_str(), "rb");
  if (!in) return false;
  std::vector<unsigned char> buffer(std::size_t{1} << 18);
  while (bytes > 0) {
    const int got =
        gzread(in, buffer.data(), static_cast<unsigned>(std::min<std::uint64_t>(bytes, buffer.size())));
    if (got <= 0) break;
    bytes -= static_cast<std::uint64_t>(got);
  }
  gzclose(in);
  return bytes == 0;
}

double mm_per_unit(const nifti_image& image) {
  if (image.xyz_units == NIFTI_UNITS_METER) return 1000;
  if (image.xyz_units == NIFTI_UNITS_MICRON) return 1e-3;
  return 1;
}

Affine read_transform(const std::string& file, const nifti_image& image, std::string& orientation) {
  if (image.sform_code <= 0 && image.qform_code <= 0)
    fail(file, "has neither sform nor qform: left and right cannot be told");
  orientation = image.sform_code > 0 ? "sform" : "qform";
  const mat44& matrix = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
  Affine result;
  const double mm = mm_per_unit(image);
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 4; ++j) result.row[i][j] = mm * static_cast<double>(matrix.m[i][j]);
  for (const auto& row : result.row)
    for (const double number : row)
      if (!std::isfinite(number) || std::abs(number) > 1e6)
        fail(file, fmt::format("its {} holds {}", orientation, number));
  LabelImage edges;
  edges.to_world = result;
  double product = 1;
  for (const double edge : edges.spacing_mm()) {
    if (!(edge >= smallest_voxel_mm && edge <= largest_voxel_mm))
      fail(file, fmt::format("its {} gives voxels of {:.4g} mm; they must lie in [{}, {}] mm", orientation,
                             edge, smallest_voxel_mm, largest_voxel_mm));
    product *= edge;
  }
  constexpr double least_sine = 1e-3;  // volume of a voxel over that of a box with its edges
  if (!(std::abs(determinant(result)) > least_sine * product))
    fail(file, fmt::format("its {} is singular", orientation));
  return result;
}

template <typename T>
void read_voxels(const std::string& file, const nifti_image& nim, LabelImage& image) {
  const T* data = static_cast<const T*>(nim.data);
  const auto slope = static_cast<double>(nim.scl_slope), inter = static_cast<double>(nim.scl_inter);
  const bool scaled =
      slope != 0 && std::isfinite(slope) && std::isfinite(inter) && (slope != 1 || inter != 0);
  std::map<std::int32_t, std::uint8_t> places;  // in the order of appearance
  image.voxels.resize(image.size());
  std::int32_t last = 0;
  std::uint8_t last_place = 0;
  for (std::size_t i = 0; i < image.voxels.size(); ++i) {
    double value = static_cast<double>(data[i]);
    if (scaled) value = slope * value + inter;
    const double whole = std::round(value);
    if (!(std::abs(value - whole) <= whole_number_tolerance) || std::abs(whole) > 2e9)
      fail(file, fmt::format("voxel {} holds {}, which is no label", i, value));
    const auto label = static_cast<std::int32_t>(whole);
    if (places.empty() || label != last) {
      if (!places.contains(label) && places.size() == 256)
        fail(file, "holds more than 256 different values: an image, not a label map");
      last = label;
      last_place = places.emplace(label, static_cast<std::uint8_t>(places.size())).first->second;
    }
    image.voxels[i] = last_place;
  }
  std::array<std::uint8_t, 256> sorted{};
  for (const auto& [label, place] : places) {  // a map ascends
    sorted[place] = static_cast<std::uint8_t>(image.labels.size());
    image.labels.push_back(label);
  }
  image.counts.assign(image.labels.size(), 0);
  for (std::uint8_t& voxel : image.voxels) ++image.counts[voxel = sorted[voxel]];
}

}  // namespace

Affine compose(const Affine& a, const Affine& b) {
  Affine c;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 4; ++j) {
      c.row[i][j] = j == 3 ? a.row[i][3] : 0;
      for (size_t k = 0; k < 3; ++k) c.row[i][j] += a.row[i][k] * b.row[k][j];
    }
  return c;
}

double determinant(const Affine& a) {
  const auto& r = a.row;
  return r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) -
         r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
         r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
}

Affine inverse(const Affine& a) {
  Affine b;
  const double d = determinant(a);
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) {
      const size_t r = (j + 1) % 3, s = (j + 2) % 3, p = (i + 1) % 3, q = (i + 2) % 3;
      b.row[i][j] = (a.row[r][p] * a.row[s][q] - a.row[r][q] * a.row[s][p]) / d;
    }
  for (size_t i = 0; i < 3; ++i)
    b.row[i][3] = -(b.row[i][0] * a.row[0][3] + b.row[i][1] * a.row[1][3] + b.row[i][2] * a.row[2][3]);
  return b;
}

std::array<double, 3> LabelImage::spacing_mm() const {
  std::array<double, 3> edges;
  for (size_t j = 0; j < 3; ++j)
    edges[j] = std::hypot(to_world.row[0][j], to_world.row[1][j], to_world.row[2][j]);
  return edges;
}

bool is_nifti_name(const std::string& file) {
  return ends_with(file, ".nii") || ends_with(file, ".nii.gz");
}

LabelImage read_label_image(const std::string& file) {
  if (!is_nifti_name(file)) fail(file, "is no NIfTI-1 file by its name (.nii or .nii.gz)");
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) fail(file, "is a directory");
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) fail(file, "cannot be read: " + error.message());
  if (bytes == 0) fail(file, "is empty");
  nifti_set_debug_level(0);
  int swapped = 0;
  const std::unique_ptr<nifti_1_header, FreeHeader> header(nifti_read_header(file.c_str(), &swapped, 0));
  if (!header) fail(file, "is no NIfTI-1 file: no header can be read");
  check_header(file, *header, bytes);
  const std::unique_ptr<nifti_image, FreeImage> nim(nifti_image_read(file.c_str(), 0));
  if (!nim) fail(file, "is no valid NIfTI-1 file");

  LabelImage image;
  image.cells = {nim->nx, nim->ny, nim->nz};
  for (size_t d = 0; d < 3; ++d)
    if (image.cells[d] != header->dim[d + 1]) fail(file, "has contradictory dimensions");
  image.to_world = read_transform(file, *nim, image.orientation);
  for (int e = 0; e < nim->num_ext; ++e) {
    const nifti1_extension& extension = nim->ext_list[e];
    if (extension.ecode != comment_code || extension.esize <= 8 || !extension.edata) continue;
    std::string text(extension.edata, static_cast<size_t>(extension.esize - 8));
    image.comment += text.substr(0, text.find('\0'));
  }
  const std::uint64_t needed =
      static_cast<std::uint64_t>(header->vox_offset) + image.size() * static_cast<std::uint64_t>(nim->nbyper);
  if (!holds(file, needed) || nifti_image_load(nim.get()) != 0 || !nim->data)
    fail(file, "is cut short or damaged: not all voxels can be read");
  switch (nim->datatype) {
    case DT_UINT8:
      read_voxels<std::uint8_t>(file, *nim, image);
      break;
    case DT_INT8:
      read_voxels<std::int8_t>(file, *nim, image);
      break;
    case DT_INT16:
      read_voxels<std::int16_t>(file, *nim, image);
      break;
    case DT_UINT16:
      read_voxels<std::uint16_t>(file, *nim, image);
      break;
    case DT_INT32:
      read_voxels<std::int32_t>(file, *nim, image);
      break;
    case DT_UINT32:
      read_voxels<std::uint32_t>(file, *nim, image);
      break;
    case DT_INT64:
      read_voxels<std::int64_t>(file, *nim, image);
      break;
    case DT_UINT64:
      read_voxels<std::uint64_t>(file, *nim, image);
      break;
    case DT_FLOAT32:
      read_voxels<float>(file, *nim, image);
      break;
    case DT_FLOAT64:
      read_voxels<double>(file, *nim, image);
      break;
    default:
      fail(file, "holds voxels of a type that is no number");
  }
  return image;
}

void write_label_image(const std::string& file, const LabelImage& image) {
  nifti_1_header header{};
  header.sizeof_hdr = sizeof(header);
  header.regular = 'r';
  header.dim[0] = 3;
  header.pixdim[0] = 1;
  mat44 matrix{};
  for (size_t d = 0; d < 3; ++d) {
    if (image.cells[d] > std::numeric_limits<short>::max())
      fail(file,
           fmt::format("{} voxels along an axis are more than NIfTI-1 holds; use a larger --export-spacing",
                       image.cells[d]));
    header.dim[d + 1] = static_cast<short>(image.cells[d]);
    for (size_t j = 0; j < 4; ++j) matrix.m[d][j] = static_cast<float>(image.to_world.row[d][j]);
  }
  for (size_t d = 4; d < 8; ++d) header.dim[d] = 1;
  matrix.m[3][3] = 1;
  float unused[3];
  nifti_mat44_to_quatern(matrix, &header.quatern_b, &header.quatern_c, &header.quatern_d, &header.qoffset_x,
                         &header.qoffset_y, &header.qoffset_z, &unused[0], &unused[1], &unused[2],
                         &header.pixdim[0]);
  const auto spacing = image.spacing_mm();
  for (size_t d = 0; d < 3; ++d) header.pixdim[d + 1] = static_cast<float>(spacing[d]);
  header.qform_code = header.sform_code = NIFTI_XFORM_ALIGNED_ANAT;
  std::memcpy(header.srow_x, matrix.m[0], sizeof(header.srow_x));
  std::memcpy(header.srow_y, matrix.m[1], sizeof(header.srow_y));
  std::memcpy(header.srow_z, matrix.m[2], sizeof(header.srow_z));
  header.datatype = DT_UINT8;
  header.bitpix = 8;
  header.scl_slope = 1;
  header.xyzt_units = NIFTI_UNITS_MM;
  header.intent_code = NIFTI_INTENT_LABEL;
  std::strncpy(header.descrip, "Cohort labels; table in the extension (code 6)", sizeof(header.descrip) - 1);
  std::memcpy(header.magic, "n+1", 4);

  std::string extension(4, '\0');  // no extension
  if (!image.comment.empty()) {
    constexpr std::size_t multiple = 16;
    const auto size =
        static_cast<std::int32_t>((image.comment.size() + 8 + multiple - 1) / multiple * multiple);
    const std::int32_t code = comment_code;
    extension[0] = 1;
    extension.resize(12 + static_cast<size_t>(size) - 8, '\0');
    std::memcpy(&extension[4], &size, 4);
    std::memcpy(&extension[8], &code, 4);
    std::memcpy(&extension[12], image.comment.data(), image.comment.size());
  }
  header.vox_offset = static_cast<float>(sizeof(header) + extension.size());

  std::vector<std::uint8_t> values(image.voxels.size());
  std::transform(image.voxels.begin(), image.voxels.end(), values.begin(),
                 [&](std::uint8_t place) { return static_cast<std::uint8_t>(image.labels[place]); });
  constexpr const char* gzipped = "wb6";
  constexpr const char* plain = "wbT";
  gzFile out = gzopen(file.c_str(), ends_with(file, ".gz") ? gzipped : plain);
  if (!out) fail(file, std::string("cannot be written: ") + std::strerror(errno));
  const auto put = [&](const void* data, std::size_t size) { return gzfwrite(data, 1, size, out) == size; };
  const bool written = put(&header, sizeof(header)) && put(extension.data(), extension.size()) &&
                       put(values.data(), values.size());
  if (gzclose(out) != Z_OK || !written) fail(file, "cannot be written");
}

}  // namespace cohort
