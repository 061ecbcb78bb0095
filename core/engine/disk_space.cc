#include "core/engine/disk_space.h"

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <sys/statvfs.h>

namespace strata {

absl::Status DiskSpace::Check(int part) const {
  constexpr std::uint64_t kMostLeft = std::uint64_t{64} << 20;
  struct statvfs disk = {};
  if (::statvfs(file_.c_str(), &disk) != 0) return absl::OkStatus();
  const std::uint64_t unit = disk.f_frsize;
  const std::uint64_t left =
      std::min(kMostLeft, disk.f_blocks * unit / 4) / static_cast<std::uint64_t>(part);
  const std::uint64_t free = disk.f_bavail * unit;
  if (free >= left) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("the disk has ",
                   free >> 20,
                   " MiB free, of which the last ",
                   left >> 20,
                   " MiB are kept for deleting; delete scans or make room, then retry"));
}

}  // namespace strata
