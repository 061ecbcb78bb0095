// Scans of a map: one by its id, or all in one loop.
#ifndef STRATA_CORE_ENGINE_MAP_SCAN_PAGES_H_
#define STRATA_CORE_ENGINE_MAP_SCAN_PAGES_H_

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/storage/storage.h"
#include "core/world/scan.h"

namespace strata {

// Each scan that `query` asks for, by number, with its pose of `epoch`; a page of query.limit is in
// memory at a time. Errors are those of StorageReader::ListScans().
absl::Status ForEachScan(StorageReader& reader,
                         ScanQuery query,
                         std::uint64_t epoch,
                         absl::FunctionRef<void(PosedScan)> body);

// The same, for those that have a pose in the epoch.
absl::Status ForEachPosedScan(StorageReader& reader,
                              const ScanQuery& query,
                              std::uint64_t epoch,
                              absl::FunctionRef<void(PosedScan)> body);

// False of one that was deleted.
absl::StatusOr<bool> IsThere(StorageReader& reader, ScanNumber number, std::uint64_t epoch);

// NOT_FOUND.
absl::StatusOr<PosedScan> GetScanById(StorageReader& reader, const ScanId& id, std::uint64_t epoch);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_SCAN_PAGES_H_
