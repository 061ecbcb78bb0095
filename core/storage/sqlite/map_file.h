// Map files as they lie on a disk: read where nobody has them, and given another place.
#ifndef STRATA_CORE_STORAGE_SQLITE_MAP_FILE_H_
#define STRATA_CORE_STORAGE_SQLITE_MAP_FILE_H_

#include <cstdint>
#include <filesystem>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/storage/sqlite/database.h"

namespace strata {

// A file that nobody has open and that was closed well, of the current format; nobody may open it
// meanwhile. FAILED_PRECONDITION where that is not so, and for another program's file; NOT_FOUND,
// DATA_LOSS.
absl::StatusOr<Database> OpenSqliteMapAtRest(const std::filesystem::path& file);

// Leaves all there is in the file itself. Closing does so too, but tells nobody where it fails.
absl::Status EmptyLog(Database& database);

// Copies the map file `from`, of any format that this program reads and whoever has it open, to
// `to`, which must not be there; there it has the current format, and its clock is at least
// `least_clock`. Durable when this returns. FAILED_PRECONDITION for another program's file or a
// newer format; DATA_LOSS for a damaged one; ALREADY_EXISTS; CANCELLED, DEADLINE_EXCEEDED by
// `stop`. An error leaves an unusable file.
absl::Status CopySqliteMap(const std::filesystem::path& from,
                           const std::filesystem::path& to,
                           std::uint64_t least_clock,
                           const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_MAP_FILE_H_
