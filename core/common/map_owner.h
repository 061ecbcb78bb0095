// Which server has a map that this one cannot serve, said by the status of a refused call.
#ifndef STRATA_CORE_COMMON_MAP_OWNER_H_
#define STRATA_CORE_COMMON_MAP_OWNER_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace strata {

// `status` with the owner's name attached (a payload), over one it had; OK stays OK.
absl::Status WithMapOwner(absl::Status status, absl::string_view owner);

// The attached name; nullopt where no other server is the reason.
std::optional<std::string> MapOwnerOf(const absl::Status& status);

}  // namespace strata

#endif  // STRATA_CORE_COMMON_MAP_OWNER_H_
