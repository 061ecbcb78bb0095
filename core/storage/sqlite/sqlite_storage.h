// One map in one SQLite file (core/storage/FORMAT.md).
#ifndef STRATA_CORE_STORAGE_SQLITE_SQLITE_STORAGE_H_
#define STRATA_CORE_STORAGE_SQLITE_SQLITE_STORAGE_H_

#include <cstdint>
#include <filesystem>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

struct SqliteOptions {
  // Largest size of the map's file; writes beyond it are RESOURCE_EXHAUSTED. 0: no bound.
  std::uint64_t max_file_bytes = 0;
};

// Makes the file with its parameters and default profile, its clock at `clock`. ALREADY_EXISTS if
// there is one. It is complete when this returns; a crash inside leaves a file that does not open
// as a map.
absl::Status CreateSqliteMap(const std::filesystem::path& file,
                             const MapParameters& parameters,
                             absl::Time created,
                             std::uint64_t clock = 0);

// NOT_FOUND without a file; FAILED_PRECONDITION for another program's file or a newer format;
// DATA_LOSS if it is damaged.
absl::StatusOr<std::unique_ptr<MapStorage>> OpenSqliteStorage(const std::filesystem::path& file,
                                                              const SqliteOptions& options);

// Reads a file that nobody has open and that was closed well; nobody may open it while the reader
// lives. FAILED_PRECONDITION where that is not so, and for another program's file or another format
// than the newest: it has to be opened. NOT_FOUND, DATA_LOSS as above.
absl::StatusOr<std::unique_ptr<StorageReader>> ReadSqliteMapAtRest(
    const std::filesystem::path& file);

// OK for a file that was made as a map, damaged or newer as it may be; FAILED_PRECONDITION saying
// what else the file is.
absl::Status CheckIsSqliteMap(const std::filesystem::path& file);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_SQLITE_STORAGE_H_
