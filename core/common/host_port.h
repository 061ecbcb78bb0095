// Where a server listens.
#ifndef STRATA_CORE_COMMON_HOST_PORT_H_
#define STRATA_CORE_COMMON_HOST_PORT_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

struct HostPort {
  std::string host;  // without the brackets of IPv6
  int port = 0;      // 0 to 65535; 0: any free one

  // Only this machine reaches it: 127.0.0.0/8, ::1 or "localhost".
  bool loopback() const;
  // HOST:PORT, [HOST]:PORT for IPv6.
  std::string ToString() const;
};

// INVALID_ARGUMENT unless `text` is HOST:PORT or [IPV6]:PORT.
absl::StatusOr<HostPort> ParseHostPort(absl::string_view text);

}  // namespace strata

#endif  // STRATA_CORE_COMMON_HOST_PORT_H_
