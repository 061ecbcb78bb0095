#include "client/cli/connect.h"

#include <memory>

#include "client/sdk/client.h"
#include "core/engine/engine.h"

namespace strata::cli {

absl::StatusOr<std::unique_ptr<api::Database>> OpenDatabase(const Target& target) {
  if (!target.embedded.empty()) {
    return OpenEngine({.directory = target.embedded});
  }
  return sdk::Connect({.target = target.server});
}

}  // namespace strata::cli
