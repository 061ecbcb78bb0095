// stratad import: a map file becomes a map.
#ifndef STRATA_SERVER_IMPORT_COMMAND_H_
#define STRATA_SERVER_IMPORT_COMMAND_H_

#include <CLI/CLI.hpp>

#include "server/token_commands.h"

namespace strata::server {

// Adds `import MAP FILE` to `app`; parsing sets `selected` where it was written.
void AddImportCommand(CLI::App& app, CommandAction& selected);

}  // namespace strata::server

#endif  // STRATA_SERVER_IMPORT_COMMAND_H_
