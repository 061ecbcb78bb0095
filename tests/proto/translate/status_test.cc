#include "proto/translate/status.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "tests/support/status_matchers.h"

namespace strata::translate {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;

TEST(TranslateStatusTest, EveryCodeComesBackWithMessageReasonAndId) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status status = WithReason(
        absl::Status(static_cast<absl::StatusCode>(code), "scan 7: é is odd"), "REQUEST");
    const grpc::Status sent = ToGrpcStatus(status, "id-1");
    EXPECT_EQ(static_cast<int>(sent.error_code()), code);
    const absl::Status back = FromGrpcStatus(sent);
    EXPECT_THAT(back, StatusIs(status.code(), "scan 7: é is odd"));
    ASSERT_TRUE(DetailOf(back).has_value());
    EXPECT_EQ(DetailOf(back)->reason(), "REQUEST");
    EXPECT_EQ(DetailOf(back)->metadata().at("request_id"), "id-1");
  }
  EXPECT_THAT(FromGrpcStatus(ToGrpcStatus(absl::OkStatus(), "id")), IsOk());
}

TEST(TranslateStatusTest, OnlyWhatMayHelpNamesARetryDelay) {
  const auto delay = [](absl::Status status) {
    return RetryDelayOf(FromGrpcStatus(ToGrpcStatus(status, "id")));
  };
  EXPECT_EQ(delay(absl::NotFoundError("x")), std::nullopt);
  EXPECT_EQ(delay(absl::InternalError("x")), std::nullopt);
  EXPECT_GT(delay(absl::ResourceExhaustedError("x")), absl::ZeroDuration());
  EXPECT_GT(delay(absl::UnavailableError("x")), absl::ZeroDuration());
  // One that is said goes along, whatever the code.
  const absl::Duration said = absl::Milliseconds(4321);
  EXPECT_EQ(delay(WithRetryDelay(absl::UnavailableError("x"), said)), said);
  EXPECT_EQ(delay(WithRetryDelay(absl::AbortedError("x"), said)), said);
  // The same too large request is too large another time.
  EXPECT_EQ(delay(WithReason(absl::ResourceExhaustedError("x"), kRequestReason)), std::nullopt);
}

TEST(TranslateStatusTest, AReasonGivenFirstStays) {
  const absl::Status status = WithReason(WithReason(absl::AbortedError("x"), "A"), "B");
  EXPECT_EQ(DetailOf(status)->reason(), "A");
  EXPECT_EQ(DetailOf(WithReason(absl::OkStatus(), "A")), std::nullopt);
}

TEST(TranslateStatusTest, LongMessagesAreCutBetweenCharacters) {
  std::string message(kMaxMessageBytes - 1, 'a');
  message += "é and more";
  const grpc::Status sent = ToGrpcStatus(absl::InternalError(message), "id");
  EXPECT_EQ(sent.error_message(), std::string(kMaxMessageBytes - 1, 'a'));
}

TEST(TranslateStatusTest, DetailsOfOthersAreNoDetail) {
  const grpc::Status foreign(grpc::StatusCode::ABORTED, "odd", "\xFF not ours");
  const absl::Status status = FromGrpcStatus(foreign);
  EXPECT_THAT(status, StatusIs(absl::StatusCode::kAborted, "odd"));
  EXPECT_EQ(DetailOf(status), std::nullopt);
}

// trouble_test.py has gRPC say these words.
TEST(TranslateStatusTest, ADroppedStreamMayBeTriedAgainALargeMessageMayNot) {
  EXPECT_THAT(FromGrpcStatus(
                  {grpc::StatusCode::RESOURCE_EXHAUSTED, "Received RST_STREAM with error code 11"}),
              StatusIs(absl::StatusCode::kUnavailable, ::testing::HasSubstr("short of memory")));
  EXPECT_THAT(FromGrpcStatus({grpc::StatusCode::RESOURCE_EXHAUSTED,
                              "Received message larger than max (5 vs. 4)"}),
              StatusIs(absl::StatusCode::kResourceExhausted, ::testing::_));
  EXPECT_THAT(FromGrpcStatus(ToGrpcStatus(absl::ResourceExhaustedError("RST_STREAM"), "7-1")),
              StatusIs(absl::StatusCode::kResourceExhausted, "RST_STREAM"));
}

TEST(TranslateStatusTest, ScanErrorsCarryTheSame) {
  const absl::Status status = absl::AlreadyExistsError("scan run/1 has other content");
  const absl::Status back = FromScanError(ToScanError(status, "id-2"));
  EXPECT_THAT(back, StatusIs(absl::StatusCode::kAlreadyExists, "scan run/1 has other content"));
  EXPECT_EQ(DetailOf(back)->reason(), "DATABASE");
  EXPECT_EQ(DetailOf(back)->metadata().at("request_id"), "id-2");
}

TEST(TranslateStatusTest, AScanErrorWithoutACodeIsNoSuccess) {
  v1::ScanError error;
  error.set_message("not taken");
  EXPECT_THAT(FromScanError(error), StatusIs(absl::StatusCode::kUnknown, "not taken"));
}

}  // namespace
}  // namespace strata::translate
