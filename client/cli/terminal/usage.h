// What a wrong command line is answered with.
#ifndef STRATA_CLIENT_CLI_TERMINAL_USAGE_H_
#define STRATA_CLIENT_CLI_TERMINAL_USAGE_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include <CLI/CLI.hpp>

namespace strata::cli {

// That of `names` which takes the fewest insertions, deletions, changes and swaps of neighbours to
// become `word`; empty if all of them take more than a third of its letters.
std::string Nearest(absl::string_view word, const std::vector<std::string>& names);

// The message for `error`, which `root` threw while it parsed: a word or an option that nobody
// knows is named first, with the nearest one that exists, whatever else is missing. Ends with where
// help is found.
std::string UsageMessage(const CLI::App& root, const CLI::ParseError& error);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_USAGE_H_
