// Which file lies under a name: whether it is still the one that was opened.
#ifndef STRATA_CORE_STORAGE_SQLITE_FILE_STATE_H_
#define STRATA_CORE_STORAGE_SQLITE_FILE_STATE_H_

#include <cstdint>
#include <filesystem>
#include <optional>

#include "absl/status/status.h"

namespace strata {

struct FileState {
  std::uint64_t device = 0;
  std::uint64_t inode = 0;
  std::uint64_t bytes = 0;

  bool SameFile(const FileState& other) const {
    return device == other.device && inode == other.inode;
  }
};

// nullopt where there is none.
std::optional<FileState> StateOfFile(const std::filesystem::path& path);

// What is said of a file of an open map that is not there as it was. UNAVAILABLE, since robots
// should keep their scans until somebody has mended it.
absl::Status TakenAway(const std::filesystem::path& file);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_FILE_STATE_H_
