// The last room of a disk is for what frees some.
#ifndef STRATA_CORE_ENGINE_MAP_DISK_SPACE_H_
#define STRATA_CORE_ENGINE_MAP_DISK_SPACE_H_

#include <cstdint>
#include <filesystem>
#include <utility>

#include "absl/status/status.h"

namespace strata {

// Uploads leave a quarter of a disk free, 64 MiB at most, and integration half of that: with the
// rest scans can be deleted, logs be written back into their maps, and maps be opened. What could
// be done without leaves twice as much, and a quarter of what a map's file may take.
// Thread-safe.
class DiskSpace {
 public:
  explicit DiskSpace(std::filesystem::path file) : file_(std::move(file)) {}

  // RESOURCE_EXHAUSTED, saying how much is free.
  absl::Status CheckForUpload() const { return Check(2, 0); }
  // Before `bytes` of rows are written: first to the log, later to the map.
  absl::Status CheckForIntegration(std::uint64_t bytes) const { return Check(1, 2 * bytes); }
  // `max_file_bytes`: largest size of the map's file; 0: none.
  absl::Status CheckForKeeping(std::uint64_t max_file_bytes) const;

 private:
  // Whether there is `halves` / 2 of what uploads leave when `taken_bytes` are gone and the log is
  // in the map. A disk that does not say is taken for one with room.
  absl::Status Check(std::uint64_t halves, std::uint64_t taken_bytes) const;

  const std::filesystem::path file_;  // on the disk
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_DISK_SPACE_H_
