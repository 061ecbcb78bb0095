#include "client/cli/connect.h"

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <glog/logging.h>

#include "client/sdk/client.h"
#include "core/common/status.h"
#include "core/engine/engine.h"

namespace strata::cli {

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
  STRATA_ASSIGN_OR_RETURN(const ClientOptions options, ClientOptionsOf(target.server));
  return Connect(options);
}

}  // namespace strata::cli
