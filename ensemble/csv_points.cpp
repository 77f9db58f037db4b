#include "ensemble/csv_points.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace cohort {
namespace {

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t start = 0;;) {
    const auto comma = line.find(',', start);
    cells.push_back(trim(line.substr(start, comma - start)));
    if (comma == std::string_view::npos) return cells;
    start = comma + 1;
  }
}

class LineMistakes {
 public:
  explicit LineMistakes(std::string file) : file_(std::move(file)) {}
  void add(std::size_t line, const std::string& what) {
    if (++count_ > 20) return;
    text_ += fmt::format("{}{}:{}: {}", text_.empty() ? "" : "\n", file_, line, what);
  }
  void raise() const {
    if (count_ > 20) throw std::invalid_argument(fmt::format("{}\nand {} more", text_, count_ - 20));
    if (count_ > 0) throw std::invalid_argument(text_);
  }

 private:
  std::string file_, text_;
  std::size_t count_ = 0;
};

void read_header(CsvPoints& points, const std::vector<std::string_view>& cells, std::size_t line,
                 const ParameterTable& parameters, LineMistakes& mistakes) {
  for (const auto cell : cells) {
    const std::string path(cell);
    const int index = parameters.find(path);
    if (index < 0)
      mistakes.add(line, fmt::format("the scene has no parameter \"{}\"", path));
    else if (parameters[index].structural)
      mistakes.add(line, path + " is shared by the whole campaign and cannot differ between members");
    if (std::find(points.paths.begin(), points.paths.end(), path) != points.paths.end())
      mistakes.add(line, path + " occurs twice");
    points.paths.push_back(path);
  }
}

void read_row(CsvPoints& points, const std::vector<std::string_view>& cells, std::size_t line,
              const ParameterTable& parameters, LineMistakes& mistakes) {
  if (cells.size() != points.paths.size()) {
    mistakes.add(line, std::to_string(cells.size()) + " values for " + std::to_string(points.paths.size()) +
                           " parameters");
    return;
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    double value = 0;
    const auto [end, error] = std::from_chars(cells[i].data(), cells[i].data() + cells[i].size(), value);
    if (cells[i].empty() || error != std::errc{} || end != cells[i].data() + cells[i].size()) {
      mistakes.add(line, fmt::format("\"{}\" is no number for {}", cells[i], points.paths[i]));
    } else if (const int index = parameters.find(points.paths[i]);
               index >= 0 && !(value >= parameters[index].lower && value <= parameters[index].upper)) {
      mistakes.add(line, fmt::format("{} = {} is outside its range [{}, {}]", points.paths[i], cells[i],
                                     parameters[index].lower, parameters[index].upper));
    }
    points.values.push_back(value);
  }
  ++points.rows;
}

}  // namespace

CsvPoints read_csv_points(const std::filesystem::path& file, const ParameterTable& parameters,
                          std::size_t most_rows) {
  std::ifstream in(file);
  if (!in) throw std::invalid_argument(file.string() + ": cannot be read");
  LineMistakes mistakes(file.string());
  CsvPoints points;
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    const auto content = trim(text);
    if (content.empty() || content.front() == '#') continue;
    const auto cells = split(content);
    if (points.paths.empty())
      read_header(points, cells, line, parameters, mistakes);
    else if (points.rows < most_rows)
      read_row(points, cells, line, parameters, mistakes);
    else {
      mistakes.add(line,
                   fmt::format("more than {} rows (the host holds every member's parameters in memory); "
                               "split the campaign",
                               most_rows));
      break;
    }
  }
  if (points.paths.empty()) mistakes.add(1, "a header of parameter paths is missing");
  mistakes.raise();
  return points;
}

}  // namespace cohort
