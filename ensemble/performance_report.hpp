#pragma once

#include <string>

#include "ensemble/store.hpp"

namespace cohort {

/// What all ranks of a run did together.
struct RunTotals {
  double members = 0, simulated_ms = 0, cell_updates = 0;
  double wall_s = 0;  ///< of the slowest rank
  int ranks = 1;
};

/// The report at the end of a run: a line per kernel (calls, ms, GB/s of its least traffic, share of the
/// device's own triad) of one rank, then the rates of all ranks.
std::string performance_report(const ProcessPerformance& rank, const RunTotals& totals);

}  // namespace cohort
