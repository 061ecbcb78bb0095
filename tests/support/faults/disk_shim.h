// Stands between SQLite and the disk in this process: sees, refuses or follows what goes by.
#ifndef STRATA_TESTS_SUPPORT_FAULTS_DISK_SHIM_H_
#define STRATA_TESTS_SUPPORT_FAULTS_DISK_SHIM_H_

#include <cstdint>
#include <functional>
#include <string>

namespace strata::testing {

struct DiskOperation {
  enum class Kind : std::uint8_t {
    kOpen,
    kDelete,
    kRead,
    kWrite,
    kTruncate,
    kSync,
    kShmMap,
    kShmLock,
  };
  Kind kind = Kind::kOpen;
  std::string file;         // its path; empty for a file without a name
  std::int64_t offset = 0;  // of a truncation: the new size
  std::int64_t count = 0;   // bytes read or written
  std::int64_t size = 0;    // of the file before a write or truncation
};

// While it lives, files that SQLite opens pass through it. One may live at a time, and what was
// opened meanwhile must be closed before it ends.
class DiskShim {
 public:
  // `before` answers SQLITE_OK, or the error that SQLite gets in place of the operation; `after` is
  // told of those that succeeded. Both are called by many threads at once.
  using Before = std::function<int(const DiskOperation&)>;
  using After = std::function<void(const DiskOperation&)>;
  explicit DiskShim(Before before, After after = nullptr);
  ~DiskShim();
  DiskShim(const DiskShim&) = delete;
  DiskShim& operator=(const DiskShim&) = delete;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_FAULTS_DISK_SHIM_H_
