// Preloaded into a process, kills it with SIGKILL at its COHORT_KILL_AT-th call that changes a file, so that
// a test can visit every moment of a creation and a commit. A write is cut in half first. With
// COHORT_COUNT_CALLS=FILE it only counts, and writes the count there at the end. Calls of the program and of
// the HDF5 library alike come through here. With COHORT_FAIL_COMMITS=FILE every fdatasync of that file, which
// ends the writes of a row, gives an error as of a broken disk.
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace {

std::atomic<long> calls = 0;

template <typename Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

bool now() {
  static const char* at = std::getenv("COHORT_KILL_AT");
  return ++calls == (at ? std::atol(at) : -1);
}

void die_if_now() {
  if (now()) kill(getpid(), SIGKILL);
}

struct Report {
  ~Report() {
    if (const char* path = std::getenv("COHORT_COUNT_CALLS"))
      if (FILE* out = std::fopen(path, "w")) {
        std::fprintf(out, "%ld\n", calls.load());
        std::fclose(out);
      }
  }
} report;

template <typename... Arguments>
ssize_t torn_write(const char* name, int file, const void* data, size_t count, Arguments... offset) {
  static auto* original = real<ssize_t(int, const void*, size_t, Arguments...)>(name);
  if (now()) {
    original(file, data, count / 2, offset...);
    kill(getpid(), SIGKILL);
  }
  return original(file, data, count, offset...);
}

/// By the file's identity: OpenCL compilers flush files of their own.
bool commits_fail(int file) {
  const char* path = std::getenv("COHORT_FAIL_COMMITS");
  struct stat one, other;
  return path && stat(path, &one) == 0 && fstat(file, &other) == 0 && one.st_dev == other.st_dev &&
         one.st_ino == other.st_ino;
}

}  // namespace

extern "C" {

ssize_t pwrite(int file, const void* data, size_t count, off_t offset) {
  return torn_write("pwrite", file, data, count, offset);
}
ssize_t pwrite64(int file, const void* data, size_t count, off64_t offset) {
  return torn_write("pwrite64", file, data, count, offset);
}
int ftruncate64(int file, off64_t length) {
  die_if_now();
  return real<int(int, off64_t)>("ftruncate64")(file, length);
}
int ftruncate(int file, off_t length) {
  die_if_now();
  return real<int(int, off_t)>("ftruncate")(file, length);
}
int posix_fallocate(int file, off_t offset, off_t length) {
  die_if_now();
  return real<int(int, off_t, off_t)>("posix_fallocate")(file, offset, length);
}
int fsync(int file) {
  die_if_now();
  return real<int(int)>("fsync")(file);
}
int fdatasync(int file) {
  die_if_now();
  if (commits_fail(file)) {
    errno = EIO;
    return -1;
  }
  return real<int(int)>("fdatasync")(file);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  die_if_now();
  return real<int(int, const char*, int, const char*, unsigned)>("renameat2")(from_folder, from, to_folder,
                                                                              to, flags);
}
}
