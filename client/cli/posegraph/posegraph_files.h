// The verbs of `posegraph` that read and write files.
#ifndef STRATA_CLIENT_CLI_POSEGRAPH_POSEGRAPH_FILES_H_
#define STRATA_CLIENT_CLI_POSEGRAPH_POSEGRAPH_FILES_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddPosegraphExchange(Commands& commands, CLI::App* noun);
// The verb `track`, in track_command.cc.
void AddPosegraphTrack(Commands& commands, CLI::App* noun);
void AddPosegraphOptimize(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_POSEGRAPH_POSEGRAPH_FILES_H_
