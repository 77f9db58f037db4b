#include "ensemble/draw.hpp"

#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>

namespace cohort {

namespace {

/// The environment with the source tree as the place of Python's modules.
std::vector<std::string> environment() {
  std::vector<std::string> variables = {"PYTHONPATH=" COHORT_SOURCE_DIR};
  for (char** entry = environ; entry && *entry; ++entry)
    if (!std::string_view(*entry).starts_with("PYTHONPATH=")) variables.emplace_back(*entry);
  return variables;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

void draw(const std::string& script, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {"/usr/bin/python3", "-m", "analysis." + script},
                           variables = environment();
  command.insert(command.end(), arguments.begin(), arguments.end());
  pid_t child = -1;
  int status = posix_spawn(&child, command[0].c_str(), nullptr, nullptr, pointers(command).data(),
                           pointers(variables).data());
  if (status == 0)
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  if (status != 0) spdlog::warn("the picture was not drawn; in the source tree: {}", fmt::join(command, " "));
}

}  // namespace cohort
