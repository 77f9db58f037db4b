#include <spdlog/fmt/fmt.h>

#include <cstdio>

#include "ensemble/choose_device.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/table.hpp"

namespace cohort {

ExitCode command_devices() {
  choose_device("", {});  // says what to install where there is none
  TextTable table(
      {Align::right, Align::left, Align::left, Align::right, Align::right, Align::left, Align::left});
  table.add({"index", "kind", "name", "memory", "triad", "platform", "id"});
  const std::vector<DeviceInfo> all = devices();
  for (size_t i = 0; i < all.size(); ++i) {
    const DeviceInfo& info = all[i];
    std::string triad;
    try {
      triad = fmt::format("{:.0f} GB/s", Device(info).triad_GB_per_s());
    } catch (const std::exception& error) {
      // A device that lists itself but does not run must not hide the others.
      triad = fmt::format("fails: {}", error.what());
    }
    table.add({std::to_string(i), info.gpu ? "gpu" : "cpu", info.name, human_bytes(info.memory_bytes), triad,
               info.platform, info.unique_id});
  }
  std::fputs(table.text().c_str(), stdout);
  return ExitCode::done;
}

}  // namespace cohort
