// Whether what a job made is of an earlier state of the map.
#ifndef STRATA_CLIENT_CLI_TERMINAL_STALE_H_
#define STRATA_CLIENT_CLI_TERMINAL_STALE_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/cli/terminal/command.h"

namespace strata::cli {

// What a job looked at.
struct LookedAt {
  std::uint64_t epoch = 0;
  std::uint64_t scans = 0;  // 0: what came from deleted ones is gone
};

// Whether the map has another epoch now, or fewer scans than were looked at, which is said on
// stderr: "WHAT of epoch 3, the map is at 4; CURE", "WHAT of 34 scans, the map has 29; CURE".
absl::StatusOr<bool> IsOfEarlierState(Context& context,
                                      const std::string& map,
                                      const LookedAt& looked_at,
                                      absl::string_view what,
                                      absl::string_view cure);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_STALE_H_
