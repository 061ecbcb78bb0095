#include "core/common/status.h"

#include <memory>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::IsOkAndHolds;
using testing::StatusIs;

TEST(StatusTest, AnnotateKeepsTheCodeAndPutsWhereInFront) {
  EXPECT_THAT(Annotate(absl::DataLossError("checksum differs"), "tile 0/3/-1"),
              StatusIs(absl::StatusCode::kDataLoss, "tile 0/3/-1: checksum differs"));
  STRATA_EXPECT_OK(Annotate(absl::OkStatus(), "tile"));
}

TEST(StatusTest, AnnotateKeepsWhatComesWithAStatus) {
  const absl::Status full = WithRetryDelay(absl::ResourceExhaustedError("full"), absl::Seconds(2));
  EXPECT_EQ(RetryDelayOf(Annotate(full, "scan robot/3")), absl::Seconds(2));
}

absl::Status Pass(const absl::Status& first, int& reached) {
  STRATA_RETURN_IF_ERROR(first);
  ++reached;
  if (reached > 0) STRATA_RETURN_IF_ERROR(absl::NotFoundError("second"));
  return absl::OkStatus();
}

TEST(StatusTest, ReturnIfErrorEndsAtTheFirstError) {
  int reached = 0;
  EXPECT_THAT(Pass(absl::AbortedError("first"), reached),
              StatusIs(absl::StatusCode::kAborted, "first"));
  EXPECT_EQ(reached, 0);
  EXPECT_THAT(Pass(absl::OkStatus(), reached), StatusIs(absl::StatusCode::kNotFound, "second"));
  EXPECT_EQ(reached, 1);
}

absl::StatusOr<std::unique_ptr<int>> Make(int value) {
  if (value < 0) return absl::InvalidArgumentError("negative");
  return std::make_unique<int>(value);
}

absl::StatusOr<int> Sum(int a, int b) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<int> first, Make(a));
  std::unique_ptr<int> second;
  STRATA_ASSIGN_OR_RETURN(second, Make(b));
  return *first + *second;
}

TEST(StatusTest, AssignOrReturnMovesTheValueOrReturnsTheStatus) {
  EXPECT_THAT(Sum(2, 3), IsOkAndHolds(5));
  EXPECT_THAT(Sum(2, -3), StatusIs(absl::StatusCode::kInvalidArgument, "negative"));
}

absl::Status Call(absl::FunctionRef<absl::Status()> call) { return call(); }

// Compiles only as long as the macros' variables do not shadow each other (-Wshadow).
absl::Status PassNested(int value, int& reached) {
  STRATA_RETURN_IF_ERROR(Call([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(Call([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(const int sum, Sum(value, 1));
      reached = sum;
      return absl::OkStatus();
    }));
    return absl::OkStatus();
  }));
  return absl::OkStatus();
}

TEST(StatusTest, MacrosNestInLambdas) {
  int reached = 0;
  STRATA_EXPECT_OK(PassNested(2, reached));
  EXPECT_EQ(reached, 3);
  EXPECT_THAT(PassNested(-2, reached), StatusIs(absl::StatusCode::kInvalidArgument, "negative"));
}

}  // namespace
}  // namespace strata
