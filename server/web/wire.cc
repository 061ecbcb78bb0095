#include "server/web/wire.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include <nlohmann/json.hpp>

#include "proto/translate/status.h"

namespace strata::server::web {
namespace {

struct CodeRow {
  absl::string_view name;
  int http;
};

// By number of the code; both columns are those of Connect's specification.
constexpr std::array<CodeRow, 17> kCodes = {{{"ok", 200},
                                             {"canceled", 499},
                                             {"unknown", 500},
                                             {"invalid_argument", 400},
                                             {"deadline_exceeded", 504},
                                             {"not_found", 404},
                                             {"already_exists", 409},
                                             {"permission_denied", 403},
                                             {"resource_exhausted", 429},
                                             {"failed_precondition", 400},
                                             {"aborted", 409},
                                             {"out_of_range", 400},
                                             {"unimplemented", 501},
                                             {"internal", 500},
                                             {"unavailable", 503},
                                             {"data_loss", 500},
                                             {"unauthenticated", 401}}};

const CodeRow& RowOf(grpc::StatusCode code) {
  const auto number = static_cast<std::size_t>(code);
  return kCodes[number < kCodes.size() ? number : std::size_t{grpc::UNKNOWN}];
}

// Base64 without the "=" at its end, as Connect and gRPC write bytes.
std::string Unpadded(absl::string_view bytes) {
  std::string text = absl::Base64Escape(bytes);
  text.erase(std::min(text.find('='), text.size()));
  return text;
}

nlohmann::json ErrorOf(const grpc::Status& status) {
  nlohmann::json error = {{"code", CodeName(status.error_code())},
                          {"message", status.error_message()}};
  v1::ErrorStatus sent;
  if (!sent.ParseFromString(status.error_details())) return error;
  for (const google::protobuf::Any& any : sent.details()) {
    nlohmann::json row = {{"type", absl::StripPrefix(any.type_url(), "type.googleapis.com/")},
                          {"value", Unpadded(any.value())}};
    v1::ErrorDetail detail;
    if (any.UnpackTo(&detail)) {
      nlohmann::json& clear = row["debug"];
      clear["reason"] = detail.reason();
      for (const auto& [name, value] : detail.metadata()) clear["metadata"][name] = value;
    }
    error["details"].push_back(std::move(row));
  }
  return error;
}

// Messages may quote what a client sent, which need not be UTF-8.
std::string Text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// As gRPC writes a message into a header.
std::string PercentEncoded(absl::string_view text) {
  std::string result;
  for (const char c : text) {
    const bool plain = c >= ' ' && c <= '~' && c != '%';
    if (plain) {
      result += c;
    } else {
      absl::StrAppendFormat(&result, "%%%02X", static_cast<unsigned char>(c));
    }
  }
  return result;
}

absl::Status NoTimeout(absl::string_view header, absl::string_view text) {
  return absl::InvalidArgumentError(
      absl::StrCat(header, " = \"", absl::CHexEscape(text.substr(0, 40)), "\" is no time"));
}

bool AreDigits(absl::string_view text, std::size_t most) {
  return !text.empty() && text.size() <= most &&
         std::all_of(text.begin(), text.end(), absl::ascii_isdigit);
}

}  // namespace

absl::string_view CodeName(grpc::StatusCode code) { return RowOf(code).name; }

int HttpStatusOf(grpc::StatusCode code) { return RowOf(code).http; }

std::string ErrorJson(const grpc::Status& status) { return Text(ErrorOf(status)); }

std::optional<absl::Duration> RetryDelayIn(const grpc::Status& status) {
  const std::optional<v1::ErrorDetail> detail =
      translate::DetailOf(translate::FromGrpcStatus(status));
  if (!detail.has_value()) return std::nullopt;
  const auto found = detail->metadata().find("retry_delay_ms");
  std::int64_t delay_ms = 0;
  if (found == detail->metadata().end() || !absl::SimpleAtoi(found->second, &delay_ms)) {
    return std::nullopt;
  }
  return absl::Milliseconds(delay_ms);
}

std::string Envelope(std::uint8_t flags, absl::string_view bytes) {
  std::string result;
  result.reserve(kEnvelopeBytes + bytes.size());
  result += static_cast<char>(flags);
  for (int shift = 24; shift >= 0; shift -= 8) result += static_cast<char>(bytes.size() >> shift);
  result.append(bytes.data(), bytes.size());
  return result;
}

absl::StatusOr<absl::string_view> OnlyMessage(absl::string_view body) {
  if (body.size() < kEnvelopeBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the body has ", body.size(), " bytes; an envelope of a message takes 5 and its size"));
  }
  if ((static_cast<std::uint8_t>(body[0]) & kPacked) != 0) {
    return absl::UnimplementedError("the message is compressed; this server takes plain ones");
  }
  std::uint64_t size = 0;
  for (std::size_t i = 1; i < kEnvelopeBytes; ++i) {
    size = size << 8 | static_cast<std::uint8_t>(body[i]);
  }
  body.remove_prefix(kEnvelopeBytes);
  if (size == body.size()) return body;
  return absl::InvalidArgumentError(absl::StrCat("the envelope announces ",
                                                 size,
                                                 " bytes, and ",
                                                 body.size(),
                                                 " follow; a call takes one message, whole"));
}

std::string ConnectEnd(const grpc::Status& status) {
  nlohmann::json end = nlohmann::json::object();
  if (!status.ok()) end["error"] = ErrorOf(status);
  return Envelope(kConnectEnd, Text(end));
}

std::string WebTrailers(const grpc::Status& status) {
  std::string trailers =
      absl::StrCat("grpc-status: ", static_cast<int>(status.error_code()), "\r\n");
  if (!status.ok()) {
    absl::StrAppend(&trailers, "grpc-message: ", PercentEncoded(status.error_message()), "\r\n");
    if (!status.error_details().empty()) {
      absl::StrAppend(
          &trailers, "grpc-status-details-bin: ", Unpadded(status.error_details()), "\r\n");
    }
  }
  return Envelope(kTrailers, trailers);
}

absl::StatusOr<absl::Duration> ParseConnectTimeout(absl::string_view text) {
  std::int64_t milliseconds = 0;
  if (!AreDigits(text, 10) || !absl::SimpleAtoi(text, &milliseconds)) {
    return NoTimeout("connect-timeout-ms", text);
  }
  return absl::Milliseconds(milliseconds);
}

absl::StatusOr<absl::Duration> ParseGrpcTimeout(absl::string_view text) {
  constexpr std::array<std::pair<char, absl::Duration>, 6> kUnits = {{{'H', absl::Hours(1)},
                                                                      {'M', absl::Minutes(1)},
                                                                      {'S', absl::Seconds(1)},
                                                                      {'m', absl::Milliseconds(1)},
                                                                      {'u', absl::Microseconds(1)},
                                                                      {'n', absl::Nanoseconds(1)}}};
  std::int64_t count = 0;
  if (text.empty() || !AreDigits(text.substr(0, text.size() - 1), 8) ||
      !absl::SimpleAtoi(text.substr(0, text.size() - 1), &count)) {
    return NoTimeout("grpc-timeout", text);
  }
  for (const auto& [unit, duration] : kUnits) {
    if (text.back() == unit) return count * duration;
  }
  return NoTimeout("grpc-timeout", text);
}

}  // namespace strata::server::web
