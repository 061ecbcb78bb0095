#include "client/cli/connect.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <glog/logging.h>

#include "client/sdk/client.h"
#include "core/common/status.h"
#include "core/engine/engine.h"

namespace strata::cli {

namespace {

constexpr char kTokenVariable[] = "STRATA_TOKEN";

absl::StatusOr<std::string> TokenOf(const Target& target) {
  if (target.token_file.empty()) {
    const char* token = std::getenv(kTokenVariable);
    return std::string(token == nullptr ? "" : token);
  }
  std::ifstream file(target.token_file);
  std::string token;
  if (!std::getline(file, token) || token.empty()) {
    return absl::NotFoundError(absl::StrCat("no token in ", target.token_file));
  }
  return std::string(absl::StripAsciiWhitespace(token));
}

}  // namespace

absl::StatusOr<std::unique_ptr<api::Database>> OpenDirectory(const std::string& directory) {
  // What the engine does not say through a call (a map that cannot be opened), as plain talk.
  FLAGS_logtostderr = true;
  FLAGS_log_prefix = false;
  FLAGS_minloglevel = google::GLOG_WARNING;
  if (!google::IsGoogleLoggingInitialized()) google::InitGoogleLogging("strata");
  EngineOptions options;
  options.directory = directory;
  return OpenEngine(options);
}

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const Target& target) {
  if (!target.embedded.empty()) {
    std::error_code error;
    if (!target.make_directory && !std::filesystem::exists(target.embedded, error)) {
      return absl::NotFoundError(absl::StrCat(
          "directory ", target.embedded, " does not exist; map create makes it with a first map"));
    }
    return OpenDirectory(target.embedded);
  }
  ClientOptions options;
  options.target = target.server;
  options.tls = {.ca_file = target.tls_ca,
                 .certificate_file = target.tls_certificate,
                 .key_file = target.tls_key,
                 .server_name = target.tls_name};
  STRATA_ASSIGN_OR_RETURN(options.token, TokenOf(target));
  options.insecure = target.insecure;
  options.connect_timeout = absl::Seconds(3);
  return Connect(options);
}

}  // namespace strata::cli
