#include "ensemble/hdf5.hpp"

#include <algorithm>

namespace cohort::hdf5 {
namespace {

Handle text_type() {
  // Variable length: fixed-length text of a long campaign file would not fit an object header (64 KB).
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "text type");
  check(H5Tset_size(type, H5T_VARIABLE), "text type");
  check(H5Tset_cset(type, H5T_CSET_UTF8), "text type");
  return type;
}

void write(hid_t object, const char* name, hid_t type, hid_t space, const void* data) {
  const std::string what = std::string("attribute ") + name;
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, what);
  const double none = 0;  // the library wants an address even where there is nothing to write
  check(H5Awrite(attribute, type, data ? data : &none), what);
}

Handle scalar() {
  return Handle(H5Screate(H5S_SCALAR), H5Sclose, "scalar");
}

Handle list(std::size_t size) {
  const hsize_t extent = size;
  return Handle(H5Screate_simple(1, &extent, nullptr), H5Sclose, "list");
}

}  // namespace

std::string last_error() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t {
        if (n == 0 && error->desc) *static_cast<std::string*>(out) = error->desc;
        return 0;
      },
      &text);
  return text.empty() ? "HDF5 gives no reason" : text;
}

void check(herr_t status, const std::string& what) {
  if (status < 0) throw std::runtime_error(what + ": " + last_error());
}

Handle::Handle(hid_t id, Close closing, const std::string& what) : id_(id), close_(closing) {
  if (id < 0) throw std::runtime_error(what + ": " + last_error());
}

Handle::~Handle() {
  if (id_ >= 0) close_(id_);
}

void Handle::close(const std::string& what) {
  const hid_t id = id_;
  id_ = -1;
  check(close_(id), what);
}

Handle file_in_memory() {
  constexpr std::size_t grows_by = 1 << 20;
  const std::string name = "file in memory";
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, name);
  check(H5Pset_fapl_core(access, grows_by, 0), name);
  return Handle(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, name);
}

std::string image(hid_t file) {
  check(H5Fflush(file, H5F_SCOPE_GLOBAL), "file in memory");
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  std::string bytes(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
  if (size < 0 || H5Fget_file_image(file, bytes.data(), bytes.size()) != size)
    throw std::runtime_error("file in memory: " + last_error());
  return bytes;
}

void write_attribute(hid_t object, const char* name, const std::string& value) {
  const char* text = value.c_str();
  write(object, name, text_type(), scalar(), &text);
}

void write_attribute(hid_t object, const char* name, const std::vector<std::string>& values) {
  std::vector<const char*> texts;
  for (const auto& value : values) texts.push_back(value.c_str());
  write(object, name, text_type(), list(values.size()), texts.data());
}

void write_attribute(hid_t object, const char* name, const std::vector<double>& values) {
  write(object, name, H5T_IEEE_F64LE, list(values.size()), values.data());
}

void write_attribute(hid_t object, const char* name, double value) {
  write(object, name, H5T_IEEE_F64LE, scalar(), &value);
}

void write_attribute(hid_t object, const char* name, std::uint64_t value) {
  write(object, name, H5T_STD_U64LE, scalar(), &value);
}

namespace {
Handle new_dataset(hid_t object, const std::string& path, hid_t type, hid_t space) {
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, path);
  check(H5Pset_create_intermediate_group(links, 1), path);
  return Handle(H5Dcreate2(object, path.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
                path);
}
}  // namespace

void write_numbers(hid_t object, const std::string& path, const std::vector<std::size_t>& dims,
                   const std::vector<double>& values) {
  const std::vector<hsize_t> extents(dims.begin(), dims.end());
  const Handle space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose,
                     path);
  const Handle dataset = new_dataset(object, path, H5T_IEEE_F64LE, space);
  if (!values.empty())
    check(H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path);
}

void write_texts(hid_t object, const std::string& path, const std::vector<std::string>& values) {
  const Handle type = text_type();
  const Handle dataset = new_dataset(object, path, type, list(values.size()));
  std::vector<const char*> texts;
  for (const auto& value : values) texts.push_back(value.c_str());
  if (!values.empty()) check(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), path);
}

std::string read_text(hid_t object, const char* name) {
  const auto texts = read_texts(object, name);
  return texts.empty() ? "" : texts.front();
}

std::vector<std::string> read_texts(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, name);
  const Handle space(H5Aget_space(attribute), H5Sclose, name);
  const Handle type(H5Aget_type(attribute), H5Tclose, name);
  if (H5Tis_variable_str(type) <= 0) return {};
  std::vector<char*> raw(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  if (raw.empty()) return {};
  check(H5Aread(attribute, text_type(), raw.data()), name);
  std::vector<std::string> values(raw.begin(), raw.end());
  check(H5Dvlen_reclaim(text_type(), space, H5P_DEFAULT, raw.data()), name);
  return values;
}

}  // namespace cohort::hdf5
