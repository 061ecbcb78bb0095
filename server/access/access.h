// Who calls, and whether he may.
#ifndef STRATA_SERVER_ACCESS_ACCESS_H_
#define STRATA_SERVER_ACCESS_ACCESS_H_

#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <grpcpp/security/auth_context.h>

#include "server/access/grant_table.h"
#include "server/access/right.h"

namespace strata::server {

// Metadata key of a token: "Bearer strata_…".
inline constexpr char kAuthorizationKey[] = "authorization";

// Someone the server knows.
struct Caller {
  std::string grant_id;   // empty where there are no grants
  std::string principal;  // name of the grant or of the certificate; empty: anybody
};

// Errors carry the reason ACCESS. Thread-safe.
class Access {
 public:
  // Without grants everybody who got through the door may do everything.
  explicit Access(std::unique_ptr<GrantTable> grants) : grants_(std::move(grants)) {}

  // Whether there are grants.
  bool asks() const { return grants_ != nullptr; }
  // `authorization`: the metadata, empty without; `certificate_name`: common name of the verified
  // client certificate, empty without. A token goes before the certificate. UNAUTHENTICATED.
  absl::StatusOr<Caller> Authenticate(absl::string_view authorization,
                                      absl::string_view certificate_name);
  // UNAUTHENTICATED once the caller's grant is gone or expired.
  absl::Status StillKnown(const Caller& caller);
  // Also PERMISSION_DENIED naming the right and the map that are missing.
  absl::Status Authorize(const Caller& caller, Right right, absl::string_view map);
  // Whether `map` may be shown to the caller.
  bool MayRead(const Caller& caller, absl::string_view map);
  // GrantTable::Unread(); zero without grants.
  absl::Duration TokensUnread();

 private:
  std::unique_ptr<GrantTable> grants_;  // may be null
};

// Common name of the client certificate that TLS has verified; empty without one.
std::string CertificateNameOf(const grpc::AuthContext& context);

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_ACCESS_H_
