// The verbs of `map` that have files of their own.
#ifndef STRATA_CLIENT_CLI_MAP_MAP_FILES_H_
#define STRATA_CLIENT_CLI_MAP_MAP_FILES_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddMapBackup(Commands& commands, CLI::App* noun);
void AddMapClasses(Commands& commands, CLI::App* noun);
void AddMapDiff(Commands& commands, CLI::App* noun);
void AddMapExport(Commands& commands, CLI::App* noun);
void AddMapFloorplan(Commands& commands, CLI::App* noun);
void AddMapFloors(Commands& commands, CLI::App* noun);
void AddMapGeoreference(Commands& commands, CLI::App* noun);
void AddMapMerge(Commands& commands, CLI::App* noun);
void AddMapPlaces(Commands& commands, CLI::App* noun);
void AddMapRender(Commands& commands, CLI::App* noun);
void AddMapWatch(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MAP_MAP_FILES_H_
