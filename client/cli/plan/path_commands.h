// What commands do with a path that there is already.
#ifndef STRATA_CLIENT_CLI_PLAN_PATH_COMMANDS_H_
#define STRATA_CLIENT_CLI_PLAN_PATH_COMMANDS_H_

#include <string>

#include "absl/status/status.h"

#include "client/cli/terminal/command.h"
#include "core/world/plan.h"

namespace strata::cli {

// Prints how the path stands, at once and whenever that changes; OK at Ctrl-C.
absl::Status FollowPath(Context& context, const std::string& map, const PathQuery& query);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_PLAN_PATH_COMMANDS_H_
