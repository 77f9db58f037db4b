#pragma once

namespace cohort {

/// Counts SIGTERM and SIGINT from now on instead of ending at once.
void catch_interrupts();
/// How many have come.
int interrupts();

}  // namespace cohort
