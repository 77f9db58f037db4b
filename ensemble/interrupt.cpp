#include "ensemble/interrupt.hpp"

#include <atomic>
#include <csignal>

namespace cohort {
namespace {

std::atomic<int> count = 0;
static_assert(std::atomic<int>::is_always_lock_free);  // else not to be touched in a signal handler

}  // namespace

void catch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = [](int) { ++count; };
  action.sa_flags = SA_RESTART;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
}

int interrupts() {
  return count;
}

}  // namespace cohort
