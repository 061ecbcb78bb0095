// strata posegraph …
#include "client/cli/command.h"
#include "client/cli/posegraph_files.h"

namespace strata::cli {

void AddPosegraphCommands(Commands& commands) {
  CLI::App* noun = commands.Noun("posegraph",
                                 "Poses and what is known about them",
                                 "strata posegraph optimize sphere2500.g2o --out solved.g2o");
  AddPosegraphOptimize(commands, noun);
}

}  // namespace strata::cli
