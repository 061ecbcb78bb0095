// Names that people and programs give to maps, trajectories and profiles.
#ifndef STRATA_CORE_WORLD_NAMES_H_
#define STRATA_CORE_WORLD_NAMES_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace strata {

// OK for 1 to 100 characters out of [A-Za-z0-9_.-] that do not start with '.' or '-'; such a name
// is also a safe file name. `what` begins the message, as in "map name".
absl::Status ValidateName(absl::string_view what, absl::string_view name);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_NAMES_H_
