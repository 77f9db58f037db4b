#include "solver/parameter_block.hpp"

#include <cctype>
#include <map>
#include <stdexcept>

namespace cohort {

std::string parameter_macros(const ParameterTable& table) {
  std::map<std::string, std::string> path_of;
  std::string macros;
  for (int i = 0; i < table.size(); ++i) {
    std::string name = "PARAM_" + table[i].path;
    for (char& c : name)
      if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    const auto [other, fresh] = path_of.emplace(name, table[i].path);
    if (!fresh)
      throw std::invalid_argument("parameters " + other->second + " and " + table[i].path +
                                  " differ in punctuation only");
    macros += "#define " + name + " " + std::to_string(i) + "\n";
  }
  return macros;
}

}  // namespace cohort
