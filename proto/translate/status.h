// Statuses between the core and gRPC: the one place for each direction.
#ifndef STRATA_PROTO_TRANSLATE_STATUS_H_
#define STRATA_PROTO_TRANSLATE_STATUS_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <grpcpp/support/status.h>

#include "strata/v1/error.pb.h"
#include "strata/v1/scans.pb.h"

namespace strata::translate {

// ErrorDetail::reason; see error.proto.
inline constexpr absl::string_view kRequestReason = "REQUEST";
inline constexpr absl::string_view kDatabaseReason = "DATABASE";
inline constexpr absl::string_view kServerBusyReason = "SERVER_BUSY";
inline constexpr absl::string_view kShuttingDownReason = "SHUTTING_DOWN";
inline constexpr absl::string_view kSlowReaderReason = "SLOW_READER";
inline constexpr absl::string_view kSlowSenderReason = "SLOW_SENDER";
inline constexpr absl::string_view kAccessReason = "ACCESS";
inline constexpr absl::string_view kClientLimitReason = "CLIENT_LIMIT";
inline constexpr absl::string_view kOtherServerReason = "OTHER_SERVER";

// Longest message that is sent; the rest is cut off [bytes].
inline constexpr std::size_t kMaxMessageBytes = 1024;

// `status` with a detail attached (as a payload), over the one it had.
absl::Status WithDetail(absl::Status status, const v1::ErrorDetail& detail);
// `status` with a detail of this reason, unless it has one or is OK.
absl::Status WithReason(absl::Status status, absl::string_view reason);
// The attached detail; nullopt without one.
std::optional<v1::ErrorDetail> DetailOf(const absl::Status& status);

// Code, message and detail of `status`. A detail gains the request's id and, as `retry_delay_ms`,
// the status' RetryDelayOf(); without one 200 when the code is RESOURCE_EXHAUSTED or UNAVAILABLE
// and it is not the request itself that is wrong. One with MapOwnerOf() has kOtherServerReason.
grpc::Status ToGrpcStatus(const absl::Status& status, absl::string_view request_id);
// The reverse, with delay and owner; a status whose details are not ours has none. UNAVAILABLE,
// which may be tried again, for a stream that a server short of memory has dropped.
absl::Status FromGrpcStatus(const grpc::Status& status);

// The same for one scan of an Ingest stream.
v1::ScanError ToScanError(const absl::Status& status, absl::string_view request_id);
// The reverse; never OK: UNKNOWN without a code.
absl::Status FromScanError(const v1::ScanError& error);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_STATUS_H_
