// Whether what a job made is of an earlier epoch than the map.
#ifndef STRATA_CLIENT_CLI_TERMINAL_STALE_H_
#define STRATA_CLIENT_CLI_TERMINAL_STALE_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/cli/terminal/command.h"

namespace strata::cli {

// Whether the map has another epoch now, which is said on stderr: "WHAT of epoch 3, the map is at
// 4; CURE".
absl::StatusOr<bool> IsOfEarlierEpoch(Context& context,
                                      const std::string& map,
                                      std::uint64_t epoch,
                                      absl::string_view what,
                                      absl::string_view cure);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_STALE_H_
