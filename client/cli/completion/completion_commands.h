// strata completion, and the hidden strata complete that its scripts call.
#ifndef STRATA_CLIENT_CLI_COMPLETION_COMPLETION_COMMANDS_H_
#define STRATA_CLIENT_CLI_COMPLETION_COMPLETION_COMMANDS_H_

#include <functional>
#include <memory>

#include "absl/status/statusor.h"

#include "client/cli/terminal/command.h"
#include "client/cli/terminal/contexts.h"
#include "core/api/database.h"

namespace strata::cli {

using FindTarget = std::function<absl::StatusOr<SavedContext>(const Said&)>;
using OpenTarget =
    std::function<absl::StatusOr<std::unique_ptr<api::Database>>(const SavedContext&)>;

// Added last: completes what is there. `said` outlives the commands.
void AddCompletionCommands(Commands& commands, const Said& said, FindTarget find, OpenTarget open);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_COMPLETION_COMPLETION_COMMANDS_H_
