// How long tests wait for what must happen: machines may run them at a tenth of the usual speed.
#pragma once

#include "absl/time/time.h"

namespace strata::testing {

inline constexpr absl::Duration kPatience = absl::Minutes(10);

}  // namespace strata::testing
