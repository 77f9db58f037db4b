#include "solver/footprint.hpp"

#include <algorithm>
#include <filesystem>

namespace cohort {

std::int64_t Footprint::launches() const {
  std::int64_t sum = 0;
  for (const Kernel& kernel : kernels) sum += kernel.launches;
  return sum;
}

std::size_t MemoryLedger::take(std::size_t bytes, const std::string& name,
                               const std::source_location& where) {
  const std::string file = std::filesystem::path(where.file_name()).stem().string();
  const std::lock_guard lock(mutex_);
  auto account = std::find_if(accounts_.begin(), accounts_.end(),
                              [&](const Account& a) { return a.file == file && a.name == name; });
  if (account == accounts_.end()) account = accounts_.insert(account, Account{file, name, 0, 0});
  account->now += bytes;
  now_ += bytes;
  if (now_ > peak_) remember_peak();
  return static_cast<std::size_t>(account - accounts_.begin());
}

void MemoryLedger::give_back(std::size_t account, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  accounts_[account].now -= bytes;
  now_ -= bytes;
}

void MemoryLedger::remember_peak() {
  peak_ = now_;
  for (Account& account : accounts_) account.at_peak = account.now;
}

std::size_t MemoryLedger::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

std::size_t MemoryLedger::peak() const {
  const std::lock_guard lock(mutex_);
  return peak_;
}

void MemoryLedger::restart_peak() {
  const std::lock_guard lock(mutex_);
  remember_peak();
}

std::vector<Footprint::Buffer> MemoryLedger::at_peak() const {
  std::vector<Footprint::Buffer> result;
  {
    const std::lock_guard lock(mutex_);
    for (const Account& account : accounts_)
      if (account.at_peak > 0) result.push_back({account.file, account.name, account.at_peak});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Footprint::Buffer& a, const Footprint::Buffer& b) { return a.bytes > b.bytes; });
  return result;
}

}  // namespace cohort
