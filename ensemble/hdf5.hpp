#pragma once

#include <hdf5.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace cohort::hdf5 {

/// What the library says about its last error: the innermost description on its stack.
std::string last_error();

/// Owns an identifier of the C API; closes it by the function given.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  /// Throws std::runtime_error "`what`: reason" where `id` is an error.
  Handle(hid_t id, Close closing, const std::string& what);
  ~Handle();
  Handle(Handle&& other) noexcept : id_(other.id_), close_(other.close_) { other.id_ = -1; }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  operator hid_t() const { return id_; }
  /// Closes now. Throws where closing fails, which is where the library reports writes that did not succeed.
  void close(const std::string& what);

 private:
  hid_t id_;
  Close close_;
};

/// Throws std::runtime_error "`what`: reason" where `status` is an error.
void check(herr_t status, const std::string& what);

/// A new file in memory alone, whose bytes image() gives: the library's own files leave half of what was
/// written, and a crash as the program ends, on a disk that is full.
Handle file_in_memory();
/// What a file of file_in_memory() would be on a disk.
std::string image(hid_t file);

void write_attribute(hid_t object, const char* name, const std::string& value);
void write_attribute(hid_t object, const char* name, const std::vector<std::string>& values);
void write_attribute(hid_t object, const char* name, const std::vector<double>& values);
void write_attribute(hid_t object, const char* name, double value);
void write_attribute(hid_t object, const char* name, std::uint64_t value);

/// Dataset at `path` below `object`, its groups made where they are missing. dims: of `values`, row-major.
void write_numbers(hid_t object, const std::string& path, const std::vector<std::size_t>& dims,
                   const std::vector<double>& values);
void write_texts(hid_t object, const std::string& path, const std::vector<std::string>& values);

/// Text attribute of an object, empty where it is missing or no text.
std::string read_text(hid_t object, const char* name);
/// List of texts, empty where it is missing.
std::vector<std::string> read_texts(hid_t object, const char* name);

}  // namespace cohort::hdf5
