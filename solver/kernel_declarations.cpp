#include "solver/kernel_declarations.hpp"

#include <algorithm>
#include <iomanip>
#include <stdexcept>

#include "solver/device.hpp"

namespace cohort {

namespace {

constexpr const char* ending = ".cl";

}  // namespace

std::vector<std::string> kernels_in(const std::string& folder) {
  const std::string beginning = folder + "/";
  std::vector<std::string> names;
  for (const std::string& file : kernel_files()) {
    if (!file.starts_with(beginning) || !file.ends_with(ending)) continue;
    names.push_back(
        file.substr(beginning.size(), file.size() - beginning.size() - std::string(ending).size()));
  }
  return names;
}

void read_declarations(const std::string& folder, const std::string& name,
                       const std::function<void(const std::string&, std::istringstream&)>& visit) {
  const std::vector<std::string> known = kernels_in(folder);
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw std::invalid_argument("no \"" + name + "\" in kernels/" + folder);
  const std::string file = folder + "/" + name + ending;
  std::istringstream source(kernel_source(file));
  int number = 0;
  for (std::string line; std::getline(source, line);) {
    ++number;
    if (!line.starts_with("//@")) continue;
    std::istringstream words(line.substr(3));
    try {
      std::string kind;
      words >> kind;
      visit(kind, words);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("kernels/" + file + ":" + std::to_string(number) + ": " + error.what());
    }
  }
}

Parameter read_parameter(std::istringstream& words) {
  Parameter p{};
  words >> p.path >> p.value >> p.lower >> p.upper >> p.unit >> std::quoted(p.meaning) >>
      std::quoted(p.source);
  if (!words)
    throw std::invalid_argument("want: parameter NAME DEFAULT LOWER UPPER UNIT \"meaning\" \"source\"");
  return p;
}

}  // namespace cohort
