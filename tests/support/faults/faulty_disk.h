// A disk that fails when a test says so, beneath everything that uses SQLite in this process.
#ifndef STRATA_TESTS_SUPPORT_FAULTS_FAULTY_DISK_H_
#define STRATA_TESTS_SUPPORT_FAULTS_FAULTY_DISK_H_

#include <array>
#include <cstdint>
#include <mutex>

#include "tests/support/faults/disk_shim.h"

namespace strata::testing {

enum class DiskFault : std::uint8_t {
  kFull,      // writes: no space left
  kWrite,     // writes: input/output error
  kSync,      // fsync: input/output error
  kRead,      // reads: input/output error
  kOpen,      // opening a file
  kDelete,    // removing a file
  kTruncate,  // cutting a file off
  kShm,       // mapping and locking of the log's index
};
inline constexpr int kDiskFaults = 8;

// While it lives, files that SQLite opens pass through it (DiskShim). Thread-safe.
class FaultyDisk {
 public:
  FaultyDisk();

  // From now on, after `sound` more operations of its kind, `times` of them fail.
  void Fail(DiskFault fault, std::int64_t sound, std::int64_t times = INT64_MAX / 2);
  // From now on files may grow by `bytes` in all; what is cut off or removed gives room back.
  void LeaveRoom(std::int64_t bytes);
  // Everything works again.
  void Mend();
  // How many operations have failed.
  std::int64_t failed() const;
  // How many operations of that kind there were, and by how many bytes files have grown in all.
  std::int64_t operations(DiskFault fault) const;
  std::int64_t grown() const;

 private:
  int Before(const DiskOperation& operation);
  bool FailsNow();
  // Whether there is room for it; takes it.
  bool TakeRoom(const DiskOperation& operation);

  mutable std::mutex mutex_;
  DiskFault fault_ = DiskFault::kWrite;
  std::int64_t left_ = 0;   // sound operations before the first that fails
  std::int64_t times_ = 0;  // that fail then
  std::int64_t failed_ = 0;
  std::int64_t room_ = INT64_MAX / 2;
  std::int64_t grown_ = 0;
  std::array<std::int64_t, kDiskFaults> operations_{};
  DiskShim shim_;  // last: it calls the others
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_FAULTS_FAULTY_DISK_H_
