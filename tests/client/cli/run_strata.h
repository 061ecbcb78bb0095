// Runs the built `strata` as a user would.
#ifndef STRATA_TESTS_CLIENT_CLI_RUN_STRATA_H_
#define STRATA_TESTS_CLIENT_CLI_RUN_STRATA_H_

#include <string>
#include <vector>

namespace strata::cli {

struct Ran {
  int exit_code = -1;
  std::string out;
  std::string err;
};

// The arguments go to the program as they are, without a shell.
Ran RunStrata(const std::vector<std::string>& arguments);

}  // namespace strata::cli

#endif  // STRATA_TESTS_CLIENT_CLI_RUN_STRATA_H_
