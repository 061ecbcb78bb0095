// A map of a database as a map file: how backups leave a server of maps.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_MAP_COPY_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_MAP_COPY_H_

#include <cstdint>
#include <filesystem>

#include "absl/status/status.h"

#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"

namespace strata {

// Reads all rows of `map` in the open transaction of `connection`, one at a time, into a new file
// that core/storage/sqlite opens; row by row what is there, damage too. NOT_FOUND without the map;
// ALREADY_EXISTS; CANCELLED, DEADLINE_EXCEEDED by `stop`; an error leaves an unusable file.
absl::Status CopyMapToFile(Connection& connection,
                           std::int64_t map,
                           const std::filesystem::path& file,
                           const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_MAP_COPY_H_
