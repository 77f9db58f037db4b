#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace cohort {

enum class Align { left, right };

/// Lines of text in aligned columns, two spaces between them, no trailing spaces. The first row is the
/// header.
class TextTable {
 public:
  /// One alignment for each column.
  explicit TextTable(std::vector<Align> alignment) : alignment_(std::move(alignment)) {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const;

 private:
  std::vector<Align> alignment_;
  std::vector<std::vector<std::string>> rows_;
};

/// "1.5 GB", "230 MB", "12 kB": decimal units, two to three digits.
std::string human_bytes(std::size_t bytes);
/// "0.4 s", "12 s", "3 min 20 s", "5 h 10 min".
std::string human_seconds(double seconds);

/// A reason with "#" for each number in it, so that equal causes are equal texts.
std::string masked(const std::string& reason);

}  // namespace cohort
