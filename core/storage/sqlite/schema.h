// The tables of a map file and how they came to be; FORMAT.md describes them.
#ifndef STRATA_CORE_STORAGE_SQLITE_SCHEMA_H_
#define STRATA_CORE_STORAGE_SQLITE_SCHEMA_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/types/span.h"

#include "core/storage/sqlite/database.h"

namespace strata {

// "STRA"; `file` names it "Strata map" to whoever looks.
inline constexpr std::int32_t kApplicationId = 0x53545241;
// Newest format of the truth tables this program reads and writes.
inline constexpr std::int32_t kTruthVersion = 3;

// Brings a file from its user_version to `migrations.size()`: migration i makes version i + 1 out
// of version i, each in one transaction with the change of user_version. FAILED_PRECONDITION for a
// newer version.
absl::Status Migrate(Database& database, absl::Span<const char* const> migrations);

// Makes the tables of a new, empty file.
absl::Status CreateSchema(Database& database);

// Checks whose file this is and brings its tables up to date, each step in a transaction.
// FAILED_PRECONDITION for another program's file or a newer format; DATA_LOSS for no database.
absl::Status UpgradeSchema(Database& database);

// Whether UpgradeSchema() would change nothing. The same errors; reads only.
absl::StatusOr<bool> HasCurrentSchema(Database& database);

// Drops all derived tables and makes them anew, empty and marked incomplete. Inside a transaction.
absl::Status ResetDerivedTables(Database& database);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_SCHEMA_H_
