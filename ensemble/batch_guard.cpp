#include "ensemble/batch_guard.hpp"

#include <signal.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <optional>
#include <utility>

#include "ensemble/interrupt.hpp"

namespace cohort {
namespace {

constexpr std::array fatal_signals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

// What a signal handler can reach.
std::atomic<const std::vector<RowImage>*> crash_rows = nullptr;
std::atomic<int> crash_file = -1;
std::array<struct sigaction, fatal_signals.size()> previous;

void on_fatal_signal(int number) {
  if (const auto* rows = crash_rows.exchange(nullptr)) write_rows(crash_file, *rows);
  for (std::size_t i = 0; i < fatal_signals.size(); ++i)
    if (fatal_signals[i] == number) sigaction(number, &previous[i], nullptr);
  raise(number);  // what it would have done: a backtrace, a core file, the end
}

}  // namespace

BatchGuard::BatchGuard(int file, std::chrono::duration<double> hang_after,
                       std::chrono::duration<double> grace)
    : file_(file), hang_after_(hang_after), grace_(grace) {
  static std::array<char, 65536> stack;  // a stack overflow leaves none to run the handler on
  const stack_t alternative = {.ss_sp = stack.data(), .ss_flags = 0, .ss_size = stack.size()};
  sigaltstack(&alternative, nullptr);
  struct sigaction action = {};
  action.sa_handler = on_fatal_signal;
  action.sa_flags = SA_ONSTACK;
  for (std::size_t i = 0; i < fatal_signals.size(); ++i) sigaction(fatal_signals[i], &action, &previous[i]);
  crash_file = file;
  thread_ = std::jthread([this](std::stop_token stop) { watch(stop); });
}

BatchGuard::~BatchGuard() {
  crash_rows = nullptr;
  for (std::size_t i = 0; i < fatal_signals.size(); ++i) sigaction(fatal_signals[i], &previous[i], nullptr);
}

void BatchGuard::begin(LastWill will) {
  const std::lock_guard lock(mutex_);
  will_ = std::move(will);
  begun_ = std::chrono::steady_clock::now();
  running_ = true;
  crash_rows = &will_.crash;
}

void BatchGuard::end() {
  const std::lock_guard lock(mutex_);
  crash_rows = nullptr;
  running_ = false;
}

void BatchGuard::watch(std::stop_token stop) {
  using clock = std::chrono::steady_clock;
  constexpr auto period = std::chrono::milliseconds(50);
  std::optional<clock::time_point> interrupted;
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, stop, period, [&] { return stop.stop_requested(); })) {
    const auto now = clock::now();
    if (interrupts() > 0 && !interrupted) interrupted = now;
    if (!running_) continue;
    const bool abandon = interrupted && (now - *interrupted > grace_ || interrupts() > 1);
    const bool hang = now - begun_ > hang_after_;
    if (!abandon && !hang) continue;
    // The mutex stays taken: should the batch come back now, it waits in end() for the process to leave.
    write_rows(file_, abandon ? will_.abandon : will_.hang);
    spdlog::error(abandon ? "interrupted: the members at work go back to the queue"
                          : "the device does not answer: this process gives up its batch and ends");
    spdlog::default_logger()->flush();
    _exit(exit_interrupted);
  }
}

}  // namespace cohort
