#include "core/storage/sqlite/map_file_check.h"

#include <string>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
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
  STRATA_ASSIGN_OR_RETURN(Statement check, database.Prepare("PRAGMA quick_check(1)"));
  STRATA_ASSIGN_OR_RETURN(const bool row, check.Step());
  const std::string found = row ? check.Text(0) : "no answer";
  return found == "ok" ? absl::OkStatus() : absl::DataLossError(found);
}

}  // namespace strata
