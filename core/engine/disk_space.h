// The last room of a disk is for what frees some.
#ifndef STRATA_CORE_ENGINE_DISK_SPACE_H_
#define STRATA_CORE_ENGINE_DISK_SPACE_H_

#include <cstdint>
#include <filesystem>
#include <utility>

#include "absl/status/status.h"

namespace strata {

// Uploads leave a quarter of a disk free, 64 MiB at most, and integration half of that: with the
// rest scans can be deleted, logs be written back into their maps, and maps be opened. Thread-safe.
class DiskSpace {
 public:
  explicit DiskSpace(std::filesystem::path file) : file_(std::move(file)) {}

  // RESOURCE_EXHAUSTED, saying how much is free.
  absl::Status CheckForUpload() const { return Check(1, 0); }
  // Before `bytes` of rows are written: first to the log, later to the map.
  absl::Status CheckForIntegration(std::uint64_t bytes) const { return Check(2, 2 * bytes); }

 private:
  // Whether there is the `part`-th part of what uploads leave when `taken_bytes` are gone. A disk
  // that does not say is taken for one with room.
  absl::Status Check(int part, std::uint64_t taken_bytes) const;

  const std::filesystem::path file_;  // on the disk
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DISK_SPACE_H_
