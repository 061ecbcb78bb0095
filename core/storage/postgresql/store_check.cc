#include "core/storage/postgresql/store_check.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/map_copy.h"
#include "core/storage/postgresql/tables.h"

namespace strata {
namespace {

absl::Status AddFaults(Connection& connection, StoreCheck& check) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query("SELECT name, setting FROM pg_settings WHERE name IN ('fsync', "
                       "'full_page_writes') AND setting <> 'on' ORDER BY name"));
  while (row.Next()) check.faults.push_back(absl::StrCat(row.Text(0), " is ", row.Text(1)));
  return absl::OkStatus();
}

absl::Status AddMaps(Connection& connection, StoreCheck& check) {
  STRATA_ASSIGN_OR_RETURN(Rows maps,
                          connection.Query("SELECT count(*) FROM map_place WHERE state = 1"));
  if (maps.Next()) check.maps = maps.Unsigned(0);
  if (check.format < 2) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query("SELECT server, count(*) FROM map_lease WHERE expires > clock_timestamp() "
                       "GROUP BY server"));
  while (row.Next()) check.open[std::string(row.Text(0))] = row.Unsigned(1);
  if (check.format < 5) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(
      Rows servers,
      connection.Query("SELECT server, roles FROM map_server WHERE expires > clock_timestamp()"));
  while (servers.Next()) check.servers[servers.Text(0)] = servers.Text(1);
  return absl::OkStatus();
}

// A connection of its own: whatever cannot be read breaks it.
absl::StatusOr<std::uint64_t> ReadMap(const std::string& where, std::int64_t map) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connection::Open(where));
  STRATA_RETURN_IF_ERROR(
      connection->Execute("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY; "
                          "SET LOCAL statement_timeout = 0"));
  return ReadWholeMap(*connection, map, Stop());
}

}  // namespace

absl::StatusOr<std::vector<DatabaseMapCheck>> CheckDatabaseMaps(const std::string& where) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connection::Open(where));
  std::vector<DatabaseMapCheck> checks;
  STRATA_ASSIGN_OR_RETURN(const std::int64_t format, VersionOfTables(*connection));
  if (format == 0) return checks;
  if (format > kDatabaseVersion) return OtherFormat(format);
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection->Query(
          "SELECT map, name FROM map_place WHERE state = 1 ORDER BY name COLLATE \"C\""));
  while (row.Next()) {
    const absl::StatusOr<std::uint64_t> bytes = ReadMap(where, row.Int(0));
    if (absl::IsNotFound(bytes.status())) continue;  // removed meanwhile
    checks.push_back({row.Text(1), bytes.value_or(0), bytes.status()});
  }
  return checks;
}

absl::StatusOr<StoreCheck> CheckStore(const std::string& where) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connection::Open(where));
  StoreCheck check;
  STRATA_RETURN_IF_ERROR(AddFaults(*connection, check));
  STRATA_ASSIGN_OR_RETURN(check.format, VersionOfTables(*connection));
  if (check.format == 0) return check;
  if (check.format > kDatabaseVersion) return OtherFormat(check.format);
  STRATA_RETURN_IF_ERROR(AddMaps(*connection, check));
  return check;
}

}  // namespace strata
