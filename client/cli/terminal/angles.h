// Angles on the command line.
#ifndef STRATA_CLIENT_CLI_TERMINAL_ANGLES_H_
#define STRATA_CLIENT_CLI_TERMINAL_ANGLES_H_

#include <optional>

#include "absl/strings/string_view.h"
#include <CLI/CLI.hpp>

namespace strata::cli {

enum class AngleUnit { kDegrees, kRadians };

// 20deg, 20°, 0.35rad, or a number of `unit` [rad]; nullopt for anything else and what is not
// finite.
std::optional<double> ParseAngle(absl::string_view text, AngleUnit unit = AngleUnit::kDegrees);

// Lets an option that holds a number of radians take any of these. Returns it.
CLI::Option* TakesAngle(CLI::Option* option, AngleUnit unit = AngleUnit::kDegrees);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_ANGLES_H_
