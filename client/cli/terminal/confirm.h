// Asks before what cannot be undone.
#ifndef STRATA_CLIENT_CLI_TERMINAL_CONFIRM_H_
#define STRATA_CLIENT_CLI_TERMINAL_CONFIRM_H_

#include <iosfwd>
#include <string>

#include "absl/status/status.h"
#include <CLI/CLI.hpp>

namespace strata::cli {

// Adds --yes to a verb.
void AddYes(CLI::App* verb, bool& yes);

// OK with `yes`, where nobody is there to be asked (stdin or stderr is no terminal), or if the
// answer is y or yes; else CANCELLED.
absl::Status Confirm(bool yes, const std::string& question);

// Reads the answer from `answers`, whoever is there.
absl::Status Ask(const std::string& question, std::istream& answers, std::ostream& talk);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_CONFIRM_H_
