// Growing what a stream of requests brings, within what its call may hold.
#ifndef STRATA_SERVER_SERVICES_APPEND_H_
#define STRATA_SERVER_SERVICES_APPEND_H_

#include <algorithm>
#include <cstddef>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "server/rpc/client_limits.h"

namespace strata::server {

// Makes room for `size` items in `all`, a string or vector, whose memory `memory` books, before it
// is taken. RESOURCE_EXHAUSTED: nothing has changed.
template <typename All>
absl::Status Reserve(std::size_t size, Booking& memory, All& all) {
  STRATA_RETURN_IF_ERROR(memory.Resize(size * sizeof(typename All::value_type)));
  all.reserve(size);
  return absl::OkStatus();
}

// Appends `more` to `all` likewise.
template <typename More, typename All>
absl::Status Append(const More& more, Booking& memory, All& all) {
  const std::size_t size = all.size() + more.size();
  if (size > all.capacity()) {
    // Half as much again: doubling would keep as much for nothing.
    const std::size_t capacity = std::max(size, all.capacity() + all.capacity() / 2);
    STRATA_RETURN_IF_ERROR(Reserve(capacity, memory, all));
  }
  all.insert(all.end(), more.begin(), more.end());
  return absl::OkStatus();
}

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_APPEND_H_
