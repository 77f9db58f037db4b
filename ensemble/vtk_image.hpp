#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace cohort {

/// Cell data on a box of equal cells as VTK's XML ImageData (.vti), which ParaView reads: appended raw, in
/// blocks compressed by zlib, little endian.
class VtkImage {
 public:
  VtkImage(std::array<int, 3> cells, std::array<double, 3> origin_mm, double dx_mm);

  /// A field (cells, components), x fastest, components innermost. The values are copied.
  void add(const std::string& name, std::span<const float> values, int components = 1);
  void add(const std::string& name, std::span<const std::uint8_t> values);

  /// Throws std::runtime_error with the reason where the file cannot be written.
  void write(const std::string& path) const;

 private:
  struct Array {
    std::string name, type;
    int components;
    std::vector<std::byte> compressed;  // with its header of sizes
  };
  void add(const std::string& name, const char* type, int components, std::span<const std::byte> bytes);

  std::array<int, 3> cells_;
  std::array<double, 3> origin_mm_;
  double dx_mm_;
  std::vector<Array> arrays_;
};

/// A collection of files by time (.pvd), the way ParaView opens a series. files: time in ms and name relative
/// to the collection. Throws as above.
void write_vtk_series(const std::string& path, std::span<const std::pair<double, std::string>> files);

}  // namespace cohort
