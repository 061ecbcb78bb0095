#include "client/cli/connect.h"

#include <memory>

#include "client/sdk/client.h"
#include "core/engine/engine.h"

namespace strata::cli {

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const Target& target) {
  if (!target.embedded.empty()) {
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
