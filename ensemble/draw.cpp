#include "ensemble/draw.hpp"

#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace cohort {

bool draw(const std::string& module, const std::vector<std::string>& arguments) {
  // Debian's interpreter has Debian's h5py and matplotlib; another one on the path may not.
  const char* debian = "/usr/bin/python3";
  const std::string python = std::filesystem::exists(debian) ? debian : "python3";
  std::vector<std::string> command = {python, "-m", "analysis." + module};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::vector<char*> raw;
  std::string text;
  for (std::string& word : command) {
    raw.push_back(word.data());
    text += (text.empty() ? "" : " ") + word;
  }
  raw.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    const char* before = std::getenv("PYTHONPATH");
    const std::string path = std::string(COHORT_SOURCE_DIR) + (before ? std::string(":") + before : "");
    setenv("PYTHONPATH", path.c_str(), 1);
    execvp(raw.front(), raw.data());
    _exit(127);
  }
  int status = 0;
  if (child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0)
    return true;
  spdlog::warn("no picture was drawn; in the source tree try: {}", text);
  return false;
}

}  // namespace cohort
