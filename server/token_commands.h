// stratad token: who may do what.
#ifndef STRATA_SERVER_TOKEN_COMMANDS_H_
#define STRATA_SERVER_TOKEN_COMMANDS_H_

#include <functional>
#include <ostream>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

namespace strata::server {

// Writes what it found or made to `out`.
using CommandAction = std::function<absl::Status(std::ostream& out)>;

// Adds `token add|list|revoke` to `app`; parsing sets `selected` to the verb that was written.
void AddTokenCommands(CLI::App& app, CommandAction& selected);

// "30d", "12h", "90m": days, hours, minutes from now on, at most 100 years; "never":
// InfiniteDuration(). INVALID_ARGUMENT for anything else.
absl::StatusOr<absl::Duration> ParseLifetime(absl::string_view text);

}  // namespace strata::server

#endif  // STRATA_SERVER_TOKEN_COMMANDS_H_
