#include "ensemble/claims.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace cohort {
namespace {

// Members are the bytes from 0; the others stand far above any campaign.
constexpr off_t performance_byte = off_t{1} << 60;
constexpr off_t creation_byte = performance_byte - 1;
constexpr off_t probe_byte = performance_byte - 2;
constexpr off_t test_byte = performance_byte - 3;

struct flock byte_lock(short type, off_t byte) {
  struct flock lock = {};  // l_pid must be 0
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = byte;
  lock.l_len = 1;
  return lock;
}

/// 0 or errno.
int set(int file, short type, off_t byte) {
  auto lock = byte_lock(type, byte);
  while (fcntl(file, F_OFD_SETLK, &lock) != 0)
    if (errno != EINTR) return errno;
  return 0;
}

bool is_held_elsewhere(int error) {
  return error == EAGAIN || error == EACCES;
}

bool locked_elsewhere(int file, off_t byte) {
  auto lock = byte_lock(F_WRLCK, byte);
  return fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

/// Takes the test byte through one description and tries through another. Another process may test at this
/// moment and hold the byte, so a refusal is asked again.
bool locks_exclude(int file, const std::filesystem::path& path) {
  const int other = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (other < 0) return false;
  auto lock = byte_lock(F_WRLCK, test_byte);
  const bool taken = fcntl(file, F_OFD_SETLKW, &lock) == 0;
  const bool excluded = taken && is_held_elsewhere(set(other, F_WRLCK, test_byte));
  set(file, F_UNLCK, test_byte);
  close(other);
  return excluded;
}

}  // namespace

Claims::Claims(const std::filesystem::path& store, std::int64_t first) : first_(first) {
  path_ = store.string() + ".claims";
  file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0)
    throw std::runtime_error(path_.string() +
                             ": cannot be written: " + std::generic_category().message(errno));
  work_ = locks_exclude(file_, path_);
}

Claims::~Claims() {
  close(file_);
}

bool Claims::lock(std::int64_t byte) {
  const int error = set(file_, F_WRLCK, byte);
  if (error == 0) return true;
  if (is_held_elsewhere(error)) return false;
  throw std::system_error(error, std::generic_category(), path_.string() + ": cannot be locked");
}
void Claims::unlock(std::int64_t byte) {
  if (const int error = set(file_, F_UNLCK, byte); error != 0)
    throw std::system_error(error, std::generic_category(), path_.string() + ": cannot be unlocked");
}

bool Claims::try_claim(std::int64_t member) {
  return lock(first_ + member);
}
void Claims::release(std::int64_t member) {
  unlock(first_ + member);
}
bool Claims::is_claimed_elsewhere(std::int64_t member) const {
  return locked_elsewhere(file_, first_ + member);
}

int Claims::kills(std::int64_t member) const {
  std::uint8_t count = 0;  // also beyond the end of the file
  while (pread(file_, &count, 1, first_ + member) < 0 && errno == EINTR) {
  }
  return count;
}
void Claims::count_kill(std::int64_t member) noexcept {
  const auto count = static_cast<std::uint8_t>(std::min(kills(member) + 1, 255));
  while (pwrite(file_, &count, 1, first_ + member) < 0 && errno == EINTR) {
  }
}
void Claims::forget_kills() noexcept {
  while (ftruncate(file_, 0) != 0 && errno == EINTR) {
  }
}

int Claims::claim_performance_slot(int preferred, int slots) {
  for (int i = 0; i < slots; ++i) {
    const int slot = (preferred + i) % slots;
    if (!work_ || lock(performance_byte + slot)) return slot;
  }
  return -1;
}

void Claims::begin_creation() {
  if (!work_) return;
  auto lock = byte_lock(F_WRLCK, creation_byte);
  while (fcntl(file_, F_OFD_SETLKW, &lock) != 0)
    if (errno != EINTR)
      throw std::system_error(errno, std::generic_category(), path_.string() + ": cannot be locked");
}
void Claims::end_creation() noexcept {
  set(file_, F_UNLCK, creation_byte);
}

bool Claims::hold_probe(bool hold) {
  return set(file_, hold ? F_WRLCK : F_UNLCK, probe_byte) == 0;
}
bool Claims::probe_is_held() const {
  return locked_elsewhere(file_, probe_byte);
}

}  // namespace cohort
