// strata context add|use|list|show|delete
#ifndef STRATA_CLIENT_CLI_CONTEXT_CONTEXT_COMMANDS_H_
#define STRATA_CLIENT_CLI_CONTEXT_CONTEXT_COMMANDS_H_

#include "client/cli/terminal/command.h"
#include "client/cli/terminal/contexts.h"

namespace strata::cli {

// `said` are the options of the root, which outlive the commands: what context add keeps.
void AddContextCommands(Commands& commands, const Said& said);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CONTEXT_CONTEXT_COMMANDS_H_
