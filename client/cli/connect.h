// Which database a command talks to.
#ifndef STRATA_CLIENT_CLI_CONNECT_H_
#define STRATA_CLIENT_CLI_CONNECT_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "client/cli/terminal/contexts.h"
#include "core/api/database.h"

namespace strata::cli {

// In this process.
absl::StatusOr<std::unique_ptr<api::Database>> OpenDirectory(const std::string& directory);

// The server or directory of what was said and of the contexts.
absl::StatusOr<SavedContext> TargetOf(const Said& said);

// A directory that does not exist is NOT_FOUND unless `make_directory`. Trouble with a server is
// Explained().
absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const SavedContext& target,
                                                            bool make_directory);

// NOT_FOUND of a map also says which one there is by nearly that name.
absl::Status WithNearestMap(const absl::Status& status, api::Database& database);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CONNECT_H_
