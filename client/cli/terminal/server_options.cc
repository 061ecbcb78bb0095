#include "client/cli/terminal/server_options.h"

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/status.h"

namespace strata::cli {
namespace {

absl::StatusOr<std::string> TokenOf(const ServerOptions& options) {
  const std::string& token_file = options.token_file;
  if (token_file.empty()) {
    if (!options.token.empty()) return options.token;
    const char* token = std::getenv(kTokenVariable);
    return std::string(token == nullptr ? "" : token);
  }
  std::ifstream file(token_file);
  std::string token;
  if (!std::getline(file, token) || token.empty()) {
    return absl::NotFoundError(absl::StrCat("no token in ", token_file));
  }
  return std::string(absl::StripAsciiWhitespace(token));
}

void AddDoorOptions(CLI::App& app, ServerOptions& options) {
  constexpr char kGroup[] = "Servers that ask who you are";
  const auto add = [&](const char* name, std::string& value, const char* type, const char* text) {
    app.add_option(name, value, text)->type_name(type)->group(kGroup);
  };
  add("--tls-ca", options.tls_ca, "FILE", "Use TLS, and trust servers of these authorities (PEM)");
  add("--tls-cert",
      options.tls_certificate,
      "FILE",
      "Certificate of yours (PEM), for servers that want one");
  add("--tls-key", options.tls_key, "FILE", "Its key (PEM)");
  add("--tls-name",
      options.tls_name,
      "NAME",
      "Expect this name in the server's certificate, not the host's");
  add("--token-file",
      options.token_file,
      "FILE",
      "A file with your token in its first line; else the environment's STRATA_TOKEN");
  app.add_flag("--insecure", options.insecure, "Show the token over the network in plain text")
      ->group(kGroup);
}

std::string Where(const ServerOptions& options) {
  return options.context.empty() ? options.server
                                 : absl::StrCat(options.server, " of context ", options.context);
}

}  // namespace

std::string IsAddress(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  int port = 0;
  const bool good = absl::StartsWith(text, "unix:") ||
                    (colon != std::string::npos && colon > 0 &&
                     absl::SimpleAtoi(text.substr(colon + 1), &port) && port > 0 && port <= 65535);
  return good ? "" : "expected HOST:PORT, as in 127.0.0.1:50051, got '" + text + "'";
}

CLI::Option* AddServerOptions(CLI::App& app, ServerOptions& options) {
  // No default of the parser's: it would exclude --embedded.
  if (const char* server = std::getenv(kServerVariable)) options.server = server;
  CLI::Option* const server =
      app.add_option("--server", options.server, "Address of stratad; else STRATA_SERVER")
          ->type_name("HOST:PORT")
          ->check(IsAddress)
          ->capture_default_str();
  AddDoorOptions(app, options);
  return server;
}

absl::StatusOr<ClientOptions> ClientOptionsOf(const ServerOptions& options) {
  ClientOptions client;
  client.target = options.server;
  client.tls = {.ca_file = options.tls_ca,
                .certificate_file = options.tls_certificate,
                .key_file = options.tls_key,
                .server_name = options.tls_name};
  STRATA_ASSIGN_OR_RETURN(client.token, TokenOf(options));
  client.insecure = options.insecure;
  client.connect_timeout = options.connect_timeout;
  return client;
}

absl::Status Explained(const absl::Status& status, const ServerOptions& options) {
  if (absl::IsUnauthenticated(status)) {
    return absl::UnauthenticatedError(absl::StrCat(
        status.message(), " (from ", Where(options), "; show a token with --token-file FILE)"));
  }
  if (!absl::IsUnavailable(status)) return status;
  return absl::UnavailableError(
      absl::StrCat(status.message(),
                   " (from ",
                   Where(options),
                   "; if stratad does not run there, start it and run the command again)"));
}

}  // namespace strata::cli
