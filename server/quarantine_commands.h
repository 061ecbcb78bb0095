// stratad quarantine: what to do with a map that kills the server.
#ifndef STRATA_SERVER_QUARANTINE_COMMANDS_H_
#define STRATA_SERVER_QUARANTINE_COMMANDS_H_

#include <CLI/CLI.hpp>

#include "server/token_commands.h"

namespace strata::server {

// Adds `quarantine list|add|release` to `app`; parsing sets `selected` to the verb that was
// written.
void AddQuarantineCommands(CLI::App& app, CommandAction& selected);

}  // namespace strata::server

#endif  // STRATA_SERVER_QUARANTINE_COMMANDS_H_
