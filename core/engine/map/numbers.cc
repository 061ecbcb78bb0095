#include "core/engine/map/numbers.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <system_error>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/storage/storage.h"
#include "core/world/job_kinds.h"

namespace strata {

void AddJobs(const std::vector<JobInfo>& jobs, MapNumbers& numbers) {
  for (const JobInfo& job : jobs) {
    ++numbers.jobs[{job.kind, job.state}];
    if (job.kind != kVerifyJob || job.state != JobState::kSucceeded) continue;
    numbers.verified = std::max(numbers.verified, job.updated);
  }
}

absl::Status AddContents(StorageReader& reader, std::uint64_t tile_version, MapNumbers& numbers) {
  STRATA_ASSIGN_OR_RETURN(const ScanTotals totals, reader.GetScanTotals());
  numbers.scans = totals.scans;
  numbers.scans_pending = totals.pending;
  numbers.scans_failed = totals.failed;
  STRATA_ASSIGN_OR_RETURN(const std::vector<MlsTileRow> tiles, reader.ListMlsTiles(tile_version));
  numbers.tiles = tiles.size();
  return absl::OkStatus();
}

// A database does not say what a map takes of it.
void AddFileBytes(const std::filesystem::path& file, MapNumbers& numbers) {
  for (const char* suffix : {"", "-wal"}) {
    if (file.empty()) return;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file.string() + suffix, error);
    if (error) continue;
    numbers.file_bytes += bytes;
    if (*suffix != '\0') numbers.journal_bytes = bytes;
  }
}

}  // namespace strata
