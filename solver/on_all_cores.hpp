#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <future>
#include <thread>
#include <vector>

namespace cohort {

/// work(k) of k = 0 ... count - 1, one by one on the cores that there are; an exception is thrown again here.
template <typename Work>
void on_all_cores(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next = 0;
  const auto share = [&] {
    for (std::size_t k = next++; k < count; k = next++) work(k);
  };
  const std::size_t workers = std::min<std::size_t>(count, std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::future<void>> others;
  for (std::size_t k = 1; k < workers; ++k) others.push_back(std::async(std::launch::async, share));
  share();
  for (std::future<void>& other : others) other.get();
}

}  // namespace cohort
