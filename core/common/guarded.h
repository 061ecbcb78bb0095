// What work throws becomes a status: no exception ends a thread, and with it the process.
#ifndef STRATA_CORE_COMMON_GUARDED_H_
#define STRATA_CORE_COMMON_GUARDED_H_

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/strings/match.h"

namespace strata {

// RESOURCE_EXHAUSTED; without a text where there is no memory for one either.
inline absl::Status OutOfMemory() noexcept {
  try {
    return absl::ResourceExhaustedError("the server is out of memory");
  } catch (const std::bad_alloc&) {
    return absl::Status(absl::StatusCode::kResourceExhausted, "");
  }
}

// Whether the status tells of an allocation that failed, ours or SQLite's.
inline bool IsOutOfMemory(const absl::Status& status) {
  return absl::IsResourceExhausted(status) &&
         (status.message().empty() || absl::StrContains(status.message(), "out of memory"));
}

// Runs `body`, which returns absl::Status or absl::StatusOr. RESOURCE_EXHAUSTED for an allocation
// that failed; INTERNAL for anything else that was thrown.
template <typename Body>
auto Guarded(const Body& body) -> decltype(body()) {
  try {
    try {
      return body();
    } catch (const std::bad_alloc&) {
      return OutOfMemory();
    } catch (const std::exception& e) {
      return absl::InternalError(e.what());
    }
  } catch (const std::bad_alloc&) {  // for the text
    return OutOfMemory();
  }
}

}  // namespace strata

#endif  // STRATA_CORE_COMMON_GUARDED_H_
