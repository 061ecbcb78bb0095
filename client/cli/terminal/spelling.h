// Words that people type out of habit, as the commands that are meant.
#ifndef STRATA_CLIENT_CLI_TERMINAL_SPELLING_H_
#define STRATA_CLIENT_CLI_TERMINAL_SPELLING_H_

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace strata::cli {

// `words` of a command line below `root` (without the program's name): help [NOUN [VERB]] is
// --help, version is --version, ls is map list, and below a noun ls is list and rm is delete. What
// is a command under that name stays.
std::vector<std::string> Spelled(const CLI::App& root, std::vector<std::string> words);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_SPELLING_H_
