// strata scan register
#ifndef STRATA_CLIENT_CLI_SCAN_SCAN_REGISTER_H_
#define STRATA_CLIENT_CLI_SCAN_SCAN_REGISTER_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddScanRegister(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_SCAN_REGISTER_H_
