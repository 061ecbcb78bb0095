// strata scan topics: what a recording holds.
#ifndef STRATA_CLIENT_CLI_SCAN_SCAN_TOPICS_H_
#define STRATA_CLIENT_CLI_SCAN_SCAN_TOPICS_H_

#include "client/cli/terminal/command.h"

namespace strata::cli {

void AddScanTopics(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_SCAN_TOPICS_H_
