// The plane model of a map as commands ask for it.
#ifndef STRATA_CLIENT_CLI_PLANES_FETCHED_PLANES_H_
#define STRATA_CLIENT_CLI_PLANES_FETCHED_PLANES_H_

#include <string>

#include "absl/status/statusor.h"

#include "client/cli/terminal/command.h"
#include "core/world/plane_model.h"

namespace strata::cli {

struct FetchedPlanes {
  PlaneModelInfo info;
  PlaneModel model;
  bool stale = false;  // of an earlier epoch than the map's, which is said on stderr
};

// NOT_FOUND where planes find has found none.
absl::StatusOr<FetchedPlanes> FetchPlanes(Context& context, const std::string& map);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_PLANES_FETCHED_PLANES_H_
