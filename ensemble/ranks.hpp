#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include "ensemble/choose_device.hpp"

namespace cohort {

/// Thrown on every rank but the one that tells what is wrong.
class ToldByAnotherRank : public std::runtime_error {
 public:
  ToldByAnotherRank() : std::runtime_error("told by another rank") {}
};

/// MPI for as long as it lives. A program started without mpirun is one rank. Ranks meet at start and at the
/// end only: while members run they know of each other through the shared file alone.
class Ranks {
 public:
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  bool first() const { return rank_ == 0; }
  /// This rank among those that share the host's memory.
  LocalRank local() const { return local_; }

  /// Runs `stage` on every rank. If it throws on any, all ranks throw: the lowest that failed what it
  /// had, the others ToldByAnotherRank. So that all end alike, and none waits for one that has left.
  void agree(const std::function<void()>& stage) const;
  /// The text of rank 0, on all.
  std::string broadcast(std::string text) const;
  void barrier() const;
  /// Sum over ranks, on all.
  double sum(double value) const;
  double largest(double value) const;
  bool all(bool value) const;

 private:
  int rank_ = 0, size_ = 1;
  LocalRank local_;
};

}  // namespace cohort
