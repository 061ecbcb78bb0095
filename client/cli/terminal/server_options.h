// Which server a program talks to, and who it says it is: the same words on every command line.
#ifndef STRATA_CLIENT_CLI_TERMINAL_SERVER_OPTIONS_H_
#define STRATA_CLIENT_CLI_TERMINAL_SERVER_OPTIONS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

#include "client/sdk/client.h"

namespace strata::cli {

struct ServerOptions {
  std::string server = "127.0.0.1:50051";
  std::string tls_ca;  // PEM files, see ClientTls; empty: plain text
  std::string tls_certificate;
  std::string tls_key;
  std::string tls_name;
  // First line of it is the token; empty: that of the environment's STRATA_TOKEN, if any. Never on
  // the command line: everybody on the machine sees those.
  std::string token_file;
  std::string token;      // that of a context that keeps one; after token_file
  bool insecure = false;  // a token may cross the network in plain text
  std::string context;    // the name of the context that this is of; empty: none
  // How long a server may take to answer.
  absl::Duration connect_timeout = absl::Seconds(3);
};

// The environment that is asked where the command line is silent.
inline constexpr char kTokenVariable[] = "STRATA_TOKEN";
inline constexpr char kServerVariable[] = "STRATA_SERVER";

// For CLI11: empty, or what is wrong with HOST:PORT.
std::string IsAddress(const std::string& text);

// Adds --server, whose default is the environment's STRATA_SERVER if there is one, and the options
// of servers that ask who one is. Returns --server.
CLI::Option* AddServerOptions(CLI::App& app, ServerOptions& options);

// For Connect(). NOT_FOUND for a token file without a token.
absl::StatusOr<ClientOptions> ClientOptionsOf(const ServerOptions& options);

// Trouble with a server says with which, and the cure.
absl::Status Explained(const absl::Status& status, const ServerOptions& options);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_SERVER_OPTIONS_H_
