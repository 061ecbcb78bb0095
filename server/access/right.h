// What a client may do to a map, and who a client is.
#ifndef STRATA_SERVER_ACCESS_RIGHT_H_
#define STRATA_SERVER_ACCESS_RIGHT_H_

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace strata::server {

// Each includes those before it.
enum class Right : std::uint8_t {
  kRead = 1,   // look up, plan, download, watch
  kWrite = 2,  // upload, correct, label, run jobs, delete scans
  kAdmin = 3,  // make, delete and back up the map
};

// "read", "write", "admin".
absl::string_view RightName(Right right);
// nullopt for another word.
std::optional<Right> ParseRight(absl::string_view name);

// In place of a map's name in Grant::maps: every map, those to come included. No map is named so.
inline constexpr char kAllMaps[] = "*";

// What one client may do, as it stands in the token file.
struct Grant {
  std::string id;    // public half of the token, 12 hexadecimal digits
  std::string name;  // of the client, as logs say it; a valid name (ValidateName), unique
  // SHA-256 of the token's secret half, 64 hexadecimal digits; empty: no token but a client
  // certificate with `name` as its subject's common name.
  std::string secret_sha256;
  std::map<std::string, Right, std::less<>> maps;  // by name; kAllMaps: all
  absl::Time created;
  absl::Time expires = absl::InfiniteFuture();

  // "campus:write yard:read".
  std::string RightsText() const;
  bool by_certificate() const { return secret_sha256.empty(); }
  bool Allows(Right right, absl::string_view map) const;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_RIGHT_H_
