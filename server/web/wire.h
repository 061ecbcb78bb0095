// How statuses and messages of gRPC are written for browsers: Connect and gRPC-Web.
#ifndef STRATA_SERVER_WEB_WIRE_H_
#define STRATA_SERVER_WEB_WIRE_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <grpcpp/support/status.h>

namespace strata::server::web {

// Connect's name of a code, as in "not_found"; "ok" is none of Connect's.
absl::string_view CodeName(grpc::StatusCode code);
// The status of HTTP that Connect's unary calls have for a code.
int HttpStatusOf(grpc::StatusCode code);

// Connect's JSON of an error: code, message, details. A detail of ours is also in clear.
std::string ErrorJson(const grpc::Status& status);
// What of a detail says when to come again; nullopt where that makes no sense.
std::optional<absl::Duration> RetryDelayIn(const grpc::Status& status);

// Flags of an envelope.
inline constexpr std::uint8_t kMessage = 0;
inline constexpr std::uint8_t kPacked = 1;
inline constexpr std::uint8_t kConnectEnd = 2;
inline constexpr std::uint8_t kTrailers = 0x80;
inline constexpr std::size_t kEnvelopeBytes = 5;

// One byte of flags, the size as four (big-endian), the bytes. `bytes` < 4 GiB.
std::string Envelope(std::uint8_t flags, absl::string_view bytes);
// The one message in a request's body, which lives as long as that. INVALID_ARGUMENT for another
// number, or a size that is not the body's; UNIMPLEMENTED for a compressed one.
absl::StatusOr<absl::string_view> OnlyMessage(absl::string_view body);

// The last envelope of a Connect stream.
std::string ConnectEnd(const grpc::Status& status);
// The last one of gRPC-Web.
std::string WebTrailers(const grpc::Status& status);

// Milliseconds as in Connect-Timeout-Ms, up to ten digits; INVALID_ARGUMENT.
absl::StatusOr<absl::Duration> ParseConnectTimeout(absl::string_view text);
// Up to eight digits and a unit, as in grpc-timeout; INVALID_ARGUMENT.
absl::StatusOr<absl::Duration> ParseGrpcTimeout(absl::string_view text);

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_WIRE_H_
