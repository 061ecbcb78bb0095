#include "core/storage/sqlite/map_file.h"

#include <cstdint>
#include <filesystem>
#include <system_error>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/storage/sqlite/schema.h"
#include "core/storage/sqlite/sqlite_storage.h"

namespace strata {
namespace {

// Whether what was written last may lie beside the file.
bool HasLog(const std::filesystem::path& file) {
  for (const char* suffix : {"-wal", "-journal"}) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file.string() + suffix, error);
    if (!error && bytes > 0) return true;
  }
  return false;
}

absl::Status RaiseClock(Database& database, std::uint64_t least_clock) {
  STRATA_ASSIGN_OR_RETURN(
      Statement raise,
      database.Prepare("UPDATE truth_map SET commit_sequence = max(commit_sequence, ?1)"));
  return raise.Bind(least_clock).Run();
}

}  // namespace

absl::StatusOr<Database> OpenSqliteMapAtRest(const std::filesystem::path& file) {
  STRATA_RETURN_IF_ERROR(CheckIsSqliteMap(file));
  if (HasLog(file)) return absl::FailedPreconditionError("store: the file was not closed well");
  STRATA_ASSIGN_OR_RETURN(Database database, Database::Open(file, Database::Mode::kReadAtRest));
  STRATA_ASSIGN_OR_RETURN(const bool current, HasCurrentSchema(database));
  if (!current) return absl::FailedPreconditionError("store: the file has another format");
  return database;
}

// Leaves all there is in the file itself. Closing does so too, but tells nobody where it fails.
absl::Status EmptyLog(Database& database) {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t busy,
                          database.Pragma("PRAGMA wal_checkpoint(TRUNCATE)"));
  return busy == 0 ? absl::OkStatus() : absl::UnavailableError("store: the log is in use");
}

absl::Status CopySqliteMap(const std::filesystem::path& from,
                           const std::filesystem::path& to,
                           std::uint64_t least_clock,
                           const Stop& stop) {
  STRATA_RETURN_IF_ERROR(CheckIsSqliteMap(from));
  {
    STRATA_ASSIGN_OR_RETURN(
        Database source,
        Database::Open(from, HasLog(from) ? Database::Mode::kRead : Database::Mode::kReadAtRest));
    STRATA_RETURN_IF_ERROR(source.CopyTo(to, stop));
  }
  STRATA_ASSIGN_OR_RETURN(Database copy, Database::Open(to, Database::Mode::kWrite));
  STRATA_RETURN_IF_ERROR(UpgradeSchema(copy));
  STRATA_RETURN_IF_ERROR(copy.Execute("PRAGMA journal_mode = WAL"));
  STRATA_RETURN_IF_ERROR(RaiseClock(copy, least_clock));
  return EmptyLog(copy);  // which does not follow when the file is given another name
}

}  // namespace strata
