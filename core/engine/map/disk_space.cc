#include "core/engine/map/disk_space.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <sys/statvfs.h>

#include "core/common/status.h"

namespace strata {

absl::Status DiskSpace::CheckForKeeping(std::uint64_t max_file_bytes) const {
  STRATA_RETURN_IF_ERROR(Check(4, 0));
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file_, error);
  if (max_file_bytes == 0 || error || bytes <= max_file_bytes / 4 * 3) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the map's file has ",
                                                   bytes >> 20,
                                                   " MiB of at most ",
                                                   max_file_bytes >> 20,
                                                   ", of which the last quarter is left to scans"));
}

absl::Status DiskSpace::Check(std::uint64_t halves, std::uint64_t taken_bytes) const {
  constexpr std::uint64_t kMostLeft = std::uint64_t{64} << 20;
  struct statvfs disk = {};
  if (::statvfs(file_.c_str(), &disk) != 0) return absl::OkStatus();
  const std::uint64_t unit = disk.f_frsize;
  const std::uint64_t left = std::min(kMostLeft, disk.f_blocks * unit / 4) * halves / 2;
  const std::uint64_t free = disk.f_bavail * unit;
  // What the log holds will be in the map's file as well.
  std::error_code error;
  const std::uintmax_t log = std::filesystem::file_size(file_.string() + "-wal", error);
  if (!error) taken_bytes += log;
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
