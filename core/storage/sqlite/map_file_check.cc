#include "core/storage/sqlite/map_file_check.h"

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/schema.h"
#include "core/storage/sqlite/sqlite_storage.h"

namespace strata {

absl::Status CheckSqliteMapFile(const std::filesystem::path& file, std::int64_t& format) {
  STRATA_RETURN_IF_ERROR(CheckIsSqliteMap(file));
  STRATA_ASSIGN_OR_RETURN(Database database, Database::Open(file, Database::Mode::kRead));
  STRATA_ASSIGN_OR_RETURN(format, database.Pragma("PRAGMA user_version"));
  if (format > kTruthVersion) {
    return absl::FailedPreconditionError(absl::StrCat(
        "format ", format, " is newer than ", kTruthVersion, ", the newest this program reads"));
  }
  return database.CheckPages(Stop());
}

}  // namespace strata
