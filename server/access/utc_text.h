// A moment for people and files.
#ifndef STRATA_SERVER_ACCESS_UTC_TEXT_H_
#define STRATA_SERVER_ACCESS_UTC_TEXT_H_

#include <string>

#include "absl/time/time.h"

namespace strata::server {

// RFC 3339 in UTC: 2027-01-15T08:00:00Z.
inline std::string UtcText(absl::Time time) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", time, absl::UTCTimeZone());
}

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_UTC_TEXT_H_
