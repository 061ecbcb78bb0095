// Angles on the command line.
#ifndef STRATA_CLIENT_CLI_TERMINAL_ANGLES_H_
#define STRATA_CLIENT_CLI_TERMINAL_ANGLES_H_

#include <optional>

#include "absl/strings/string_view.h"
#include <CLI/CLI.hpp>

namespace strata::cli {

// 0.35, 0.35rad, 20deg or 20° [rad]; nullopt for anything else and what is not finite.
std::optional<double> ParseAngle(absl::string_view text);

// Lets an option that holds a number of radians take any of these. Returns it.
CLI::Option* TakesAngle(CLI::Option* option);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_ANGLES_H_
