// Matchers for absl::Status and absl::StatusOr (Abseil 20220623 has none). There is deliberately no
// "not ok": name the code.
#ifndef STRATA_TESTS_SUPPORT_STATUS_MATCHERS_H_
#define STRATA_TESTS_SUPPORT_STATUS_MATCHERS_H_

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::testing {

inline const absl::Status& GetStatus(const absl::Status& status) { return status; }
template <typename T>
const absl::Status& GetStatus(const absl::StatusOr<T>& status) {
  return status.status();
}

MATCHER(IsOk, "is OK") {
  *result_listener << GetStatus(arg).ToString();
  return GetStatus(arg).ok();
}

MATCHER_P2(StatusIs, code, message, "") {
  const absl::Status& status = GetStatus(arg);
  *result_listener << status.ToString();
  return status.code() == code &&
         ::testing::ExplainMatchResult(message, std::string(status.message()), result_listener);
}

MATCHER_P(IsOkAndHolds, value, "") {
  if (!arg.ok()) {
    *result_listener << arg.status().ToString();
    return false;
  }
  return ::testing::ExplainMatchResult(value, *arg, result_listener);
}

}  // namespace strata::testing

#define STRATA_EXPECT_OK(expression) EXPECT_THAT((expression), ::strata::testing::IsOk())
#define STRATA_ASSERT_OK(expression) ASSERT_THAT((expression), ::strata::testing::IsOk())
// `lhs` takes the value of an absl::StatusOr or the test ends here.
#define STRATA_ASSERT_OK_AND_ASSIGN(lhs, expression) \
  STRATA_ASSERT_OK_AND_ASSIGN_IMPL(STRATA_TEST_CONCAT(statusor_, __LINE__), lhs, expression)
#define STRATA_ASSERT_OK_AND_ASSIGN_IMPL(result, lhs, expression) \
  auto result = (expression);                                     \
  ASSERT_THAT(result, ::strata::testing::IsOk());                 \
  lhs = *std::move(result)
#define STRATA_TEST_CONCAT_INNER(a, b) a##b
#define STRATA_TEST_CONCAT(a, b) STRATA_TEST_CONCAT_INNER(a, b)

#endif  // STRATA_TESTS_SUPPORT_STATUS_MATCHERS_H_
