#include "proto/translate/status.h"

#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"

namespace strata::translate {
namespace {

constexpr char kDetailUrl[] = "type.googleapis.com/strata.v1.ErrorDetail";
constexpr char kRequestId[] = "request_id";
constexpr char kDelay[] = "retry_delay_ms";
constexpr char kOwner[] = "owner";
constexpr absl::Duration kDefaultDelay = absl::Milliseconds(200);

v1::ErrorDetail DetailToSend(const absl::Status& status, absl::string_view request_id) {
  v1::ErrorDetail detail = DetailOf(status).value_or(v1::ErrorDetail());
  const std::optional<std::string> owner = MapOwnerOf(status);
  if (detail.reason().empty()) {
    detail.set_reason(std::string(owner.has_value() ? kOtherServerReason : kDatabaseReason));
  }
  auto& metadata = *detail.mutable_metadata();
  if (owner.has_value()) metadata[kOwner] = *owner;
  metadata[kRequestId] = std::string(request_id);
  std::optional<absl::Duration> delay = RetryDelayOf(status);
  const bool passes = absl::IsResourceExhausted(status) || absl::IsUnavailable(status);
  if (!delay.has_value() && passes && detail.reason() != kRequestReason) delay = kDefaultDelay;
  if (delay.has_value()) metadata[kDelay] = absl::StrCat(absl::ToInt64Milliseconds(*delay));
  return detail;
}

// Cuts between characters: a message that is not UTF-8 does not fit a proto string.
std::string MessageToSend(const absl::Status& status) {
  const absl::string_view message = status.message();
  if (message.size() <= kMaxMessageBytes) return std::string(message);
  std::size_t end = kMaxMessageBytes;
  while (end > 0 && (static_cast<unsigned char>(message[end]) & 0xC0U) == 0x80U) --end;
  return std::string(message.substr(0, end));
}

// A server that is short of memory drops streams below the calls (HTTP/2's ENHANCE_YOUR_CALM):
// gRPC 1.51 has the code and these words, and nobody who could say when to try again.
bool IsDroppedStream(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
         status.error_details().empty() && absl::StrContains(status.error_message(), "RST_STREAM");
}

// `status` with what a peer sent of it.
absl::Status WithSent(absl::Status status, const v1::ErrorDetail& detail) {
  const auto delay = detail.metadata().find(kDelay);
  std::int64_t ms = 0;
  if (delay != detail.metadata().end() && absl::SimpleAtoi(delay->second, &ms) && ms >= 0) {
    status = WithRetryDelay(std::move(status), absl::Milliseconds(ms));
  }
  const auto owner = detail.metadata().find(kOwner);
  if (owner != detail.metadata().end()) status = WithMapOwner(std::move(status), owner->second);
  return WithDetail(std::move(status), detail);
}

}  // namespace

absl::Status WithDetail(absl::Status status, const v1::ErrorDetail& detail) {
  status.SetPayload(kDetailUrl, absl::Cord(detail.SerializeAsString()));
  return status;
}

absl::Status WithReason(absl::Status status, absl::string_view reason) {
  if (status.ok() || status.GetPayload(kDetailUrl).has_value()) return status;
  v1::ErrorDetail detail;
  detail.set_reason(std::string(reason));
  return WithDetail(std::move(status), detail);
}

std::optional<v1::ErrorDetail> DetailOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kDetailUrl);
  v1::ErrorDetail detail;
  if (!payload.has_value() || !detail.ParseFromString(std::string(*payload))) return std::nullopt;
  return detail;
}

grpc::Status ToGrpcStatus(const absl::Status& status, absl::string_view request_id) {
  if (status.ok()) return grpc::Status::OK;
  v1::ErrorStatus error;
  error.set_code(static_cast<int>(status.code()));
  error.set_message(MessageToSend(status));
  error.add_details()->PackFrom(DetailToSend(status, request_id));
  return {static_cast<grpc::StatusCode>(error.code()), error.message(), error.SerializeAsString()};
}

absl::Status FromGrpcStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  if (IsDroppedStream(status)) {
    return absl::UnavailableError(absl::StrCat(
        "the server was short of memory and dropped the call (", status.error_message(), ")"));
  }
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  v1::ErrorStatus error;
  v1::ErrorDetail detail;
  if (error.ParseFromString(status.error_details()) && error.details_size() == 1 &&
      error.details(0).UnpackTo(&detail)) {
    return WithSent(std::move(result), detail);
  }
  return result;
}

v1::ScanError ToScanError(const absl::Status& status, absl::string_view request_id) {
  v1::ScanError error;
  error.set_code(static_cast<int>(status.code()));
  error.set_message(MessageToSend(status));
  *error.mutable_detail() = DetailToSend(status, request_id);
  return error;
}

absl::Status FromScanError(const v1::ScanError& error) {
  auto code = static_cast<absl::StatusCode>(error.code());
  // Else a scan that was not taken would seem to be.
  if (code == absl::StatusCode::kOk) code = absl::StatusCode::kUnknown;
  return WithSent(absl::Status(code, error.message()), error.detail());
}

}  // namespace strata::translate
