// The verbs of `posegraph` that work on bare files.
#ifndef STRATA_CLIENT_CLI_POSEGRAPH_FILES_H_
#define STRATA_CLIENT_CLI_POSEGRAPH_FILES_H_

#include "client/cli/command.h"

namespace strata::cli {

void AddPosegraphOptimize(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_POSEGRAPH_FILES_H_
