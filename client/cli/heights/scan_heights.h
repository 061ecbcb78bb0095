// strata scan heights
#ifndef STRATA_CLIENT_CLI_HEIGHTS_SCAN_HEIGHTS_H_
#define STRATA_CLIENT_CLI_HEIGHTS_SCAN_HEIGHTS_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddScanHeights(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_HEIGHTS_SCAN_HEIGHTS_H_
