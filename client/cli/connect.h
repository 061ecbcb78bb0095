// Which database a command talks to.
#ifndef STRATA_CLIENT_CLI_CONNECT_H_
#define STRATA_CLIENT_CLI_CONNECT_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"

#include "core/api/database.h"

namespace strata::cli {

struct Target {
  std::string server = "127.0.0.1:50051";
  std::string tls_ca;  // PEM files, see ClientTls; empty: plain text
  std::string tls_certificate;
  std::string tls_key;
  std::string tls_name;
  // First line of it is the token; empty: that of the environment's STRATA_TOKEN, if any. Never on
  // the command line: everybody on the machine sees those.
  std::string token_file;
  bool insecure = false;        // a token may cross the network in plain text
  std::string embedded;         // a directory: the database runs in this process
  bool make_directory = false;  // if there is none; else that is NOT_FOUND
};

// In this process.
absl::StatusOr<std::unique_ptr<api::Database>> OpenDirectory(const std::string& directory);

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const Target& target);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CONNECT_H_
