// Options and arguments that take the name of something: said to the parser, for completion.
#ifndef STRATA_CLIENT_CLI_TERMINAL_NAMES_H_
#define STRATA_CLIENT_CLI_TERMINAL_NAMES_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include <CLI/CLI.hpp>

namespace strata::cli {

// What can be asked of a server; but for maps, of one map. Contexts are asked of their file.
inline constexpr char kMapNames[] = "maps";
inline constexpr char kJobNames[] = "jobs";
inline constexpr char kClassifierNames[] = "classifiers";
inline constexpr char kKindNames[] = "kinds";
inline constexpr char kProfileNames[] = "profiles";
inline constexpr char kContextNames[] = "contexts";

// Says that `option` takes one of `names` (see above). Nothing is checked. Returns it.
CLI::Option* TakesName(CLI::Option* option, absl::string_view names);
// Says that it usually takes one of these words.
CLI::Option* TakesWord(CLI::Option* option, const std::vector<std::string>& words);

// What was said: empty or one of the above.
std::string NamesTaken(CLI::Option* option);
std::vector<std::string> WordsTaken(CLI::Option* option);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_NAMES_H_
