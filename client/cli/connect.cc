#include "client/cli/connect.h"

#include <memory>

#include <glog/logging.h>

#include "client/sdk/client.h"
#include "core/engine/engine.h"

namespace strata::cli {

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const Target& target) {
  if (!target.embedded.empty()) {
    // What the engine does not say through a call (a map that cannot be opened), as plain talk.
    FLAGS_logtostderr = true;
    FLAGS_log_prefix = false;
    FLAGS_minloglevel = google::GLOG_ERROR;
    google::InitGoogleLogging("strata");
    EngineOptions options;
    options.directory = target.embedded;
    return OpenEngine(options);
  }
  ClientOptions options;
  options.target = target.server;
  options.connect_timeout = absl::Seconds(3);
  return Connect(options);
}

}  // namespace strata::cli
