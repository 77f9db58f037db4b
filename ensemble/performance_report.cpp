#include "ensemble/performance_report.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ensemble/table.hpp"

namespace cohort {

namespace {

std::string kernel_table(const ProcessPerformance& rank) {
  TextTable table({Align::left, Align::right, Align::right, Align::right, Align::right, Align::right});
  table.add({"kernel", "calls", "ms", "ms/call", "GB/s", "of triad"});
  std::vector<KernelPerformance> kernels = rank.kernels;
  std::stable_sort(
      kernels.begin(), kernels.end(),
      [](const KernelPerformance& a, const KernelPerformance& b) { return a.device_ms > b.device_ms; });
  bool timed = false, undeclared = false, cached = false;
  for (const KernelPerformance& kernel : kernels) {
    if (!(kernel.device_ms > 0)) continue;  // not timed: it runs once, at set-up
    timed = true;
    const double calls = static_cast<double>(kernel.calls);
    constexpr double bytes_per_ms_of_a_GB_per_s = 1e6;
    const double rate = kernel.device_ms > 0
                            ? kernel.bytes_per_call * calls / kernel.device_ms / bytes_per_ms_of_a_GB_per_s
                            : 0;
    const bool known = rate > 0;
    undeclared = undeclared || !known;
    cached = cached || (rank.triad_GB_per_s > 0 && rate > rank.triad_GB_per_s);
    table.add(
        {kernel.kernel, std::to_string(kernel.calls), fmt::format("{:.1f}", kernel.device_ms),
         fmt::format("{:.4f}", kernel.device_ms / calls), known ? fmt::format("{:.1f}", rate) : "-",
         known && rank.triad_GB_per_s > 0 ? fmt::format("{:.0f} %", 100 * rate / rank.triad_GB_per_s) : "-"});
  }
  if (!timed) return "no kernel was timed: the first batch and its first samples compile them\n";
  std::string text = table.text();
  if (undeclared) text += "-: hardly any traffic, or as much as the wave asks for\n";
  if (cached) text += "more than 100 %: from the device's caches\n";
  return text;
}

}  // namespace

std::string performance_report(const ProcessPerformance& rank, const RunTotals& totals) {
  constexpr double seconds_per_hour = 3600;
  std::string text =
      fmt::format("{}, triad {:.1f} GB/s\n{}", rank.device, rank.triad_GB_per_s, kernel_table(rank));
  if (!(totals.wall_s > 0)) return text;
  text += fmt::format(
      "{} members on {} rank{} in {}: {:.3g} cell updates/s, {:.3g} simulated ms/s, {:.0f} hearts/h\n",
      totals.members, totals.ranks, totals.ranks == 1 ? "" : "s", human_seconds(totals.wall_s),
      totals.cell_updates / totals.wall_s, totals.simulated_ms / totals.wall_s,
      totals.members / totals.wall_s * seconds_per_hour);
  return text;
}

}  // namespace cohort
