// A disk that fails when a test says so, beneath everything that uses SQLite in this process.
#ifndef STRATA_TESTS_SUPPORT_FAULTY_DISK_H_
#define STRATA_TESTS_SUPPORT_FAULTY_DISK_H_

#include <cstdint>

namespace strata::testing {

enum class DiskFault {
  kFull,   // writes: no space left
  kWrite,  // writes: input/output error
  kSync,   // fsync: input/output error
};

// While it lives, files that SQLite opens pass through it; only one may live at a time, and what
// was opened meanwhile must be closed before it ends. Thread-safe.
class FaultyDisk {
 public:
  FaultyDisk();
  ~FaultyDisk();
  FaultyDisk(const FaultyDisk&) = delete;
  FaultyDisk& operator=(const FaultyDisk&) = delete;

  // From now on, after `sound` more operations of its kind, `times` of them fail.
  void Fail(DiskFault fault, std::int64_t sound, std::int64_t times = INT64_MAX / 2);
  // Everything works again.
  void Mend();
  // How many operations have failed.
  std::int64_t failed() const;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_FAULTY_DISK_H_
