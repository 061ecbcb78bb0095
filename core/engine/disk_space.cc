#include "core/engine/disk_space.h"

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <sys/statvfs.h>

namespace strata {

absl::Status DiskSpace::Check(int part, std::uint64_t taken_bytes) const {
  constexpr std::uint64_t kMostLeft = std::uint64_t{64} << 20;
  struct statvfs disk = {};
  if (::statvfs(file_.c_str(), &disk) != 0) return absl::OkStatus();
  const std::uint64_t unit = disk.f_frsize;
  const std::uint64_t left =
      std::min(kMostLeft, disk.f_blocks * unit / 4) / static_cast<std::uint64_t>(part);
  const std::uint64_t free = disk.f_bavail * unit;
  if (free >= left + taken_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "the disk has ",
      free >> 20,
      " MiB free, of which the last ",
      left >> 20,
      " MiB are kept for deleting",
      taken_bytes == 0 ? ""
                       : absl::StrCat("; up to ", (taken_bytes >> 20) + 1, " MiB would be written"),
      "; delete scans or make room, then retry"));
}

}  // namespace strata
