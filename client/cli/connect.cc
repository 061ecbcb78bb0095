#include "client/cli/connect.h"

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "client/cli/terminal/usage.h"
#include "client/sdk/client.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
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

absl::StatusOr<SavedContext> TargetOf(const Said& said) {
  const absl::StatusOr<std::filesystem::path> path = ContextsPath();
  if (!path.ok() && !said.context.empty()) return path.status();
  return ResolveContext(said, path.value_or(""));
}

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const SavedContext& target,
                                                            bool make_directory) {
  if (!target.embedded.empty()) {
    std::error_code error;
    if (!make_directory && !std::filesystem::exists(target.embedded, error)) {
      return absl::NotFoundError(absl::StrCat(
          "directory ", target.embedded, " does not exist; map create makes it with a first map"));
    }
    return OpenDirectory(target.embedded);
  }
  STRATA_ASSIGN_OR_RETURN(const ClientOptions options, ClientOptionsOf(target.server));
  auto database = Connect(options);
  if (database.ok() || target.server.context.empty()) return database;
  return Annotate(database.status(), absl::StrCat("context ", target.server.context));
}

absl::Status WithNearestMap(const absl::Status& status, api::Database& database) {
  absl::string_view name = status.message();
  if (!absl::IsNotFound(status) || !absl::ConsumePrefix(&name, "map ") ||
      !absl::ConsumeSuffix(&name, " does not exist")) {
    return status;
  }
  const Stop soon(SteadyNow() + absl::Seconds(1));
  const absl::StatusOr<std::vector<MapInfo>> maps =
      database.maps().List({.stop = soon, .request_id = "", .principal = ""});
  if (!maps.ok()) return status;
  std::vector<std::string> names;
  for (const MapInfo& map : *maps) names.push_back(map.name);
  const std::string nearest = Nearest(name, names);
  if (nearest.empty()) return status;
  return absl::NotFoundError(absl::StrCat(status.message(), "; did you mean ", nearest, "?"));
}

}  // namespace strata::cli
