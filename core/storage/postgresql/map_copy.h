// A map between a database and a map file, both ways.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_MAP_COPY_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_MAP_COPY_H_

#include <cstdint>
#include <filesystem>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/sqlite/database.h"

namespace strata {

// Reads all rows of `map` in the open transaction of `connection`, one at a time, into a new file
// that core/storage/sqlite opens; row by row what is there, damage too. NOT_FOUND without the map;
// ALREADY_EXISTS; CANCELLED, DEADLINE_EXCEEDED by `stop`; an error leaves an unusable file.
absl::Status CopyMapToFile(Connection& connection,
                           std::int64_t map,
                           const std::filesystem::path& file,
                           const Stop& stop);

// The other way: all rows of a map file of the current format (OpenSqliteMapAtRest()), one at a
// time, into the tables in the open transaction of `connection`, under the number `map`; its place
// is the caller's. The clock becomes `least_clock` if it is less. What the database refuses is an
// error that names the table, and leaves a transaction that can only be rolled back.
absl::Status CopyFileToMap(Database& file,
                           Connection& connection,
                           std::int64_t map,
                           std::uint64_t least_clock,
                           const Stop& stop);

// Reads all rows of `map` as CopyMapToFile() would; the bytes of its blobs and texts. The error
// names the table that can not be read. NOT_FOUND.
absl::StatusOr<std::uint64_t> ReadWholeMap(Connection& connection,
                                           std::int64_t map,
                                           const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_MAP_COPY_H_
