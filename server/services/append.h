// Growing what a stream of requests brings, within what its call may hold.
#ifndef STRATA_SERVER_SERVICES_APPEND_H_
#define STRATA_SERVER_SERVICES_APPEND_H_

#include <algorithm>
#include <cstddef>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "server/rpc/client_limits.h"

namespace strata::server {

// Appends `more` to `all`, a string or vector, whose memory `memory` books, before it is taken.
// RESOURCE_EXHAUSTED: nothing was appended.
template <typename More, typename All>
absl::Status Append(const More& more, Booking& memory, All& all) {
  const std::size_t size = all.size() + more.size();
  if (size > all.capacity()) {
    // Half as much again: doubling would keep as much for nothing.
    const std::size_t capacity = std::max(size, all.capacity() + all.capacity() / 2);
    STRATA_RETURN_IF_ERROR(memory.Resize(capacity * sizeof(typename All::value_type)));
    all.reserve(capacity);
  }
  all.insert(all.end(), more.begin(), more.end());
  return absl::OkStatus();
}

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_APPEND_H_
