// TLS: the server's certificate, and whose clients' it takes.
#ifndef STRATA_SERVER_TLS_H_
#define STRATA_SERVER_TLS_H_

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include <grpcpp/security/server_credentials.h>

namespace strata::server {

// PEM files.
struct TlsFiles {
  std::filesystem::path certificate;  // the server's, then those between it and its authority
  std::filesystem::path key;
  std::filesystem::path client_ca;  // when set, every client must show a certificate of these

  bool enabled() const { return !certificate.empty() && !key.empty(); }
};

struct TlsCertificate {
  std::string subject;  // as in "CN = map.example"
  absl::Time expires;   // of the server's own; those above it may expire before
};

// NOT_FOUND, PERMISSION_DENIED for files that cannot be read; INVALID_ARGUMENT for what is no
// certificate or key, or a key of another certificate; FAILED_PRECONDITION for a certificate that
// is not valid at `now`.
absl::StatusOr<TlsCertificate> CheckTls(const TlsFiles& files, absl::Time now);

// Follows the files: another certificate is taken up within seconds, connections that are there
// keep theirs. TLS 1.2 and 1.3. `count` times, for a processor each.
std::vector<std::shared_ptr<grpc::ServerCredentials>> TlsCredentials(const TlsFiles& files,
                                                                     int count);

}  // namespace strata::server

#endif  // STRATA_SERVER_TLS_H_
