#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cohort {

/// Affine map of three coordinates, rows of [A | b].
struct Affine {
  std::array<std::array<double, 4>, 3> row{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  std::array<double, 3> operator()(const std::array<double, 3>& p) const {
    std::array<double, 3> q;
    for (std::size_t i = 0; i < 3; ++i)
      q[i] = row[i][0] * p[0] + row[i][1] * p[1] + row[i][2] * p[2] + row[i][3];
    return q;
  }
};

/// `a` after `b`.
Affine compose(const Affine& a, const Affine& b);
double determinant(const Affine& a);
/// Of an affine map whose determinant is not zero.
Affine inverse(const Affine& a);

/// A map of integer labels. x runs fastest.
struct LabelImage {
  std::array<int, 3> cells{};  ///< voxels along i, j, k
  Affine to_world;             ///< voxel indices (centres at whole numbers) to mm: right, anterior, superior
  std::vector<std::int32_t> labels;  ///< the values that occur, ascending; at most 256
  std::vector<std::int64_t> counts;  ///< voxels of each
  std::vector<std::uint8_t> voxels;  ///< place of each voxel's value in `labels`
  std::string comment;               ///< the header's extensions of plain text (code 6), joined
  std::string orientation;           ///< "sform" or "qform": what to_world was read from

  std::size_t size() const { return std::size_t(cells[0]) * std::size_t(cells[1]) * std::size_t(cells[2]); }
  /// Lengths of the voxel's edges, mm.
  std::array<double, 3> spacing_mm() const;
};

/// Reads a NIfTI-1 file (.nii, .nii.gz): three dimensions, integers or whole numbers in floats, scaled by
/// scl_slope and scl_inter. The sform counts where its code is set, else the qform; a file with neither is
/// refused, for left and right could not be told. Nothing is allocated before the sizes in the header are
/// found to agree with the file. Throws std::runtime_error "FILE: what is wrong".
LabelImage read_label_image(const std::string& file);

/// Writes `image` with sform and qform (the transform must be a rotation and scaling for the latter), 8-bit
/// labels, and its comment as an extension. Gzipped where the name ends so. Throws std::runtime_error.
void write_label_image(const std::string& file, const LabelImage& image);

/// Whether the name ends in .nii or .nii.gz.
bool is_nifti_name(const std::string& file);

}  // namespace cohort
