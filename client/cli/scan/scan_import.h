// strata scan import: files of scans and poses into a trajectory of a map.
#ifndef STRATA_CLIENT_CLI_SCAN_SCAN_IMPORT_H_
#define STRATA_CLIENT_CLI_SCAN_SCAN_IMPORT_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddScanImport(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_SCAN_IMPORT_H_
