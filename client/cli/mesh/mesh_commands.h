// strata map mesh, strata scan mesh
#ifndef STRATA_CLIENT_CLI_MESH_MESH_COMMANDS_H_
#define STRATA_CLIENT_CLI_MESH_MESH_COMMANDS_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddMapMesh(Commands& commands, CLI::App* noun);
void AddScanMesh(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_MESH_COMMANDS_H_
