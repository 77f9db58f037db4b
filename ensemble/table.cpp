#include "ensemble/table.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
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

}  // namespace cohort
