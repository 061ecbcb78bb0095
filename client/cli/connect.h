// Which database a command talks to.
#ifndef STRATA_CLIENT_CLI_CONNECT_H_
#define STRATA_CLIENT_CLI_CONNECT_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"

#include "client/cli/terminal/server_options.h"
#include "core/api/database.h"

namespace strata::cli {

struct Target {
  ServerOptions server;
  std::string embedded;         // a directory: the database runs in this process
  bool make_directory = false;  // if there is none; else that is NOT_FOUND
};

// In this process.
absl::StatusOr<std::unique_ptr<api::Database>> OpenDirectory(const std::string& directory);

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const Target& target);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CONNECT_H_
