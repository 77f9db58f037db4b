#include "ensemble/table.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace cohort {

std::string TextTable::text() const {
  std::vector<size_t> widths(alignment_.size(), 0);
  for (const auto& row : rows_)
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string result;
  for (const auto& row : rows_) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line += "  ";
      line += alignment_[i] == Align::right ? fmt::format("{:>{}}", row[i], widths[i])
                                            : fmt::format("{:<{}}", row[i], widths[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    result += line + "\n";
  }
  return result;
}

std::string human_bytes(std::size_t bytes) {
  constexpr const char* units[] = {"B", "kB", "MB", "GB", "TB"};
  double value = static_cast<double>(bytes);
  size_t unit = 0;
  while (value >= 1000 && unit + 1 < std::size(units)) {
    value /= 1000;
    ++unit;
  }
  if (unit == 0 || value >= 100) return fmt::format("{:.0f} {}", value, units[unit]);
  return fmt::format("{:.{}f} {}", value, value >= 10 ? 1 : 2, units[unit]);  // three digits
}

std::string human_seconds(double seconds) {
  constexpr double minute = 60, hour = 3600;
  if (!std::isfinite(seconds)) return "unknown";
  if (seconds < 10) return fmt::format("{:.2g} s", seconds);
  if (seconds < minute) return fmt::format("{:.0f} s", seconds);
  if (seconds < hour)
    return fmt::format("{} min {} s", static_cast<int>(seconds / minute),
                       static_cast<int>(std::fmod(seconds, minute)));
  return fmt::format("{} h {} min", static_cast<long>(seconds / hour),
                     static_cast<int>(std::fmod(seconds, hour) / minute));
}

std::string masked(const std::string& reason) {
  std::string text;
  for (std::size_t i = 0; i < reason.size();) {
    const auto digit = [&](std::size_t k) {
      return k < reason.size() && std::isdigit(static_cast<unsigned char>(reason[k]));
    };
    const bool word =
        i > 0 && (std::isalnum(static_cast<unsigned char>(reason[i - 1])) || reason[i - 1] == '_');
    const bool sign = (reason[i] == '-' || reason[i] == '+') && digit(i + 1);
    if (word || !(digit(i) || sign)) {
      text += reason[i++];
      continue;
    }
    i += sign;
    while (digit(i) || (reason[i] == '.' && digit(i + 1))) ++i;
    if (i < reason.size() && reason[i] == 'e') {
      const std::size_t exponent =
          i + 1 < reason.size() && (reason[i + 1] == '-' || reason[i + 1] == '+') ? i + 2 : i + 1;
      if (digit(exponent))
        for (i = exponent; digit(i);) ++i;
    }
    text += '#';
  }
  return text;
}

}  // namespace cohort
