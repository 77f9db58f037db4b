#pragma once

#include <cstdint>
#include <filesystem>

namespace cohort {

/// Who works on which member: a lock on one byte of the side file `<store>.claims` for each member. The locks
/// belong to an open file description (F_OFD_SETLK, fcntl(2)), so the kernel releases those of a process that
/// dies, however it dies. The file holds a byte for each member, the number of times that a process was
/// killed with it. It must not be removed while a process works on the store.
class Claims {
 public:
  /// Opens or creates the side file of `store`. Member i is its byte `first` + i: checks come after the
  /// members. Throws std::runtime_error naming the file where it cannot be written.
  explicit Claims(const std::filesystem::path& store, std::int64_t first = 0);
  ~Claims();
  Claims(const Claims&) = delete;
  Claims& operator=(const Claims&) = delete;

  /// Whether locks exclude another open file description of this process: false on file systems without them.
  /// Between nodes only hold_probe and probe_is_held can tell.
  bool work() const { return work_; }

  /// Takes a member, or says false where another process has it. Members taken once are not refused to their
  /// holder. This, release and claim_performance_slot throw std::system_error naming the file where the
  /// system refuses for another reason.
  bool try_claim(std::int64_t member);
  void release(std::int64_t member);
  /// Whether another process has the member.
  bool is_claimed_elsewhere(std::int64_t member) const;

  /// How often a process died at work on the member without a word (SIGKILL); at most 255 are counted.
  int kills(std::int64_t member) const;
  /// Adds one; by the holder of the member. A disk that refuses it costs a count, no more.
  void count_kill(std::int64_t member) noexcept;
  /// Of all members and checks: the store is a new one.
  void forget_kills() noexcept;

  /// Takes one of `slots` rows of /performance, starting at `preferred`; -1 where all are taken.
  int claim_performance_slot(int preferred, int slots);

  /// Waits until no other process creates the store, and keeps others from it until end_creation.
  void begin_creation();
  void end_creation() noexcept;

  /// Test of locks between nodes: one rank calls hold_probe(true), and after a barrier every other rank must
  /// find the probe held. Where one does not, members must go by rank.
  bool hold_probe(bool hold);
  bool probe_is_held() const;

 private:
  bool lock(std::int64_t byte);
  void unlock(std::int64_t byte);

  std::filesystem::path path_;
  std::int64_t first_ = 0;
  int file_ = -1;
  bool work_ = false;
};

}  // namespace cohort
