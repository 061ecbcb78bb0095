// The tables of a database of maps; FORMAT.md describes them.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_TABLES_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_TABLES_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"

#include "core/storage/postgresql/connection.h"

namespace strata {

// Newest format of the tables this program reads and writes.
inline constexpr std::int64_t kDatabaseVersion = 5;

// Makes the tables where there are none, or adds what those of earlier versions lack; safe when
// others do so at the same time. FAILED_PRECONDITION for a newer format.
absl::Status MakeTables(Connection& connection);

// The format of the tables; 0: there are none.
absl::StatusOr<std::int64_t> VersionOfTables(Connection& connection);
// FAILED_PRECONDITION: that this program does not read tables of `version`.
absl::Status OtherFormat(std::int64_t version);

// "DELETE FROM … WHERE map = $1" for every table of derived data but derived_state, and for every
// table of all else but truth_map.
absl::Span<const char* const> DeletionsOfDerived();
absl::Span<const char* const> DeletionsOfTruth();

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_TABLES_H_
