#include "ensemble/vtk_image.hpp"

#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>

// VTK XML file formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
namespace cohort {

namespace {

constexpr std::size_t block_bytes = std::size_t{1} << 20;

static_assert(std::endian::native == std::endian::little, "the header says byte_order LittleEndian");

/// Number of blocks, bytes of a block, bytes of a last shorter one (0: none), compressed bytes of each; then
/// the blocks.
std::vector<std::byte> compressed(std::span<const std::byte> bytes) {
  const std::size_t blocks = (bytes.size() + block_bytes - 1) / block_bytes;
  std::vector<std::uint64_t> header = {blocks, block_bytes, bytes.size() % block_bytes};
  std::vector<std::byte> body;
  std::vector<Bytef> block(compressBound(block_bytes));
  constexpr int fast = 1;  // fields outside the tissue are constant, and the rest hardly shrinks
  for (std::size_t first = 0; first < bytes.size(); first += block_bytes) {
    const auto part = bytes.subspan(first, std::min(block_bytes, bytes.size() - first));
    uLongf size = block.size();
    if (compress2(block.data(), &size, reinterpret_cast<const Bytef*>(part.data()), part.size(), fast) !=
        Z_OK)
      throw std::runtime_error("zlib could not compress a field");
    header.push_back(size);
    const auto* begin = reinterpret_cast<const std::byte*>(block.data());
    body.insert(body.end(), begin, begin + size);
  }
  const auto head = std::as_bytes(std::span(header));
  body.insert(body.begin(), head.begin(), head.end());
  return body;
}

std::ofstream create(const std::string& path) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  return file;
}

void finish(std::ofstream& file, const std::string& path) {
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
}

}  // namespace

VtkImage::VtkImage(std::array<int, 3> cells, std::array<double, 3> origin_mm, double dx_mm)
    : cells_(cells), origin_mm_(origin_mm), dx_mm_(dx_mm) {}

void VtkImage::add(const std::string& name, const char* type, int components,
                   std::span<const std::byte> bytes) {
  arrays_.push_back({name, type, components, compressed(bytes)});
}

void VtkImage::add(const std::string& name, std::span<const float> values, int components) {
  add(name, "Float32", components, std::as_bytes(values));
}

void VtkImage::add(const std::string& name, std::span<const std::uint8_t> values) {
  add(name, "UInt8", 1, std::as_bytes(values));
}

void VtkImage::write(const std::string& path) const {
  std::ofstream file = create(path);
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", cells_[0], cells_[1], cells_[2]);
  file << "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
          "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n"
       << fmt::format("<ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\">\n", extent,
                      origin_mm_[0], origin_mm_[1], origin_mm_[2], dx_mm_, dx_mm_, dx_mm_)
       << fmt::format("<Piece Extent=\"{}\">\n<CellData Scalars=\"{}\">\n", extent,
                      arrays_.empty() ? "" : arrays_.front().name);
  std::size_t offset = 0;
  for (const Array& array : arrays_) {
    file << fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n",
        array.type, array.name, array.components, offset);
    offset += array.compressed.size();
  }
  file << "</CellData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_";
  for (const Array& array : arrays_)
    file.write(reinterpret_cast<const char*>(array.compressed.data()),
               static_cast<std::streamsize>(array.compressed.size()));
  file << "\n</AppendedData>\n</VTKFile>\n";
  finish(file, path);
}

void write_vtk_series(const std::string& path, std::span<const std::pair<double, std::string>> files) {
  std::ofstream file = create(path);
  file << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
          "byte_order=\"LittleEndian\">\n"
          "<Collection>\n";
  for (const auto& [time_ms, name] : files)
    file << fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", time_ms, name);
  file << "</Collection>\n</VTKFile>\n";
  finish(file, path);
}

}  // namespace cohort
