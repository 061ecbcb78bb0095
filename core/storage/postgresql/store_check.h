// What can be said of a database before a server uses it, and of who uses it now.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_STORE_CHECK_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_STORE_CHECK_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace strata {

struct StoreCheck {
  std::int64_t format = 0;  // of the tables; 0: there are none yet
  std::uint64_t maps = 0;
  std::map<std::string, std::uint64_t> open;   // maps by the server that has them open now
  std::map<std::string, std::string> servers;  // roles by the name of the server that lives
  std::vector<std::string> faults;  // settings with which the database loses what was acknowledged
};

// Changes nothing. The errors of Connection::Open(); FAILED_PRECONDITION for tables of a format
// that this program neither reads nor updates.
absl::StatusOr<StoreCheck> CheckStore(const std::string& where);

struct DatabaseMapCheck {
  std::string name;
  std::uint64_t bytes = 0;  // of its blobs and texts
  absl::Status status;      // the error names the table that can not be read
};

// Reads every row of every map, each map as it is at one moment, whoever has it open; by name.
absl::StatusOr<std::vector<DatabaseMapCheck>> CheckDatabaseMaps(const std::string& where);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_STORE_CHECK_H_
