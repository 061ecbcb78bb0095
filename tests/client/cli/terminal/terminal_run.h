// Runs the built `strata` on a terminal, as a person would.
#ifndef STRATA_TESTS_CLIENT_CLI_TERMINAL_TERMINAL_RUN_H_
#define STRATA_TESTS_CLIENT_CLI_TERMINAL_TERMINAL_RUN_H_

#include <string>
#include <vector>

#include "tests/client/cli/run_strata.h"

namespace strata::cli {

// On a terminal of its own of so many columns and 24 rows, where somebody types `answer`; `out` has
// all that the terminal shows, its line ends as newlines.
Ran RunOnTerminal(std::vector<std::string> arguments,
                  const std::string& answer,
                  unsigned short columns = 80);

}  // namespace strata::cli

#endif  // STRATA_TESTS_CLIENT_CLI_TERMINAL_TERMINAL_RUN_H_
