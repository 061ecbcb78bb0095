// Errors are values: the two macros that hand a failed absl::Status up, and the one that adds what
// only this layer knows.
#ifndef STRATA_CORE_COMMON_STATUS_H_
#define STRATA_CORE_COMMON_STATUS_H_

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// `status` with `where` and ": " in front of its message, and its payloads; an OK status stays as
// it is.
absl::Status Annotate(const absl::Status& status, absl::string_view where);

}  // namespace strata

#define STRATA_CONCAT_INNER(a, b) a##b
#define STRATA_CONCAT(a, b) STRATA_CONCAT_INNER(a, b)

// Returns the status of `expression` from the enclosing function unless it is OK. The variables of
// both macros are numbered, not named by line: an expression may hold a lambda that uses the macros
// itself, and all of it counts as one line.
#define STRATA_RETURN_IF_ERROR(expression) \
  STRATA_RETURN_IF_ERROR_IMPL(STRATA_CONCAT(strata_status_, __COUNTER__), expression)
#define STRATA_RETURN_IF_ERROR_IMPL(result, expression)     \
  do {                                                      \
    if (absl::Status result = (expression); !result.ok()) { \
      return result;                                        \
    }                                                       \
  } while (false)

// Evaluates an absl::StatusOr; assigns its value to `lhs` (which may declare a variable) or returns
// its status.
#define STRATA_ASSIGN_OR_RETURN(lhs, expression) \
  STRATA_ASSIGN_OR_RETURN_IMPL(STRATA_CONCAT(strata_statusor_, __COUNTER__), lhs, expression)
#define STRATA_ASSIGN_OR_RETURN_IMPL(result, lhs, expression) \
  auto result = (expression);                                 \
  if (!result.ok()) return std::move(result).status();        \
  lhs = *std::move(result)

#endif  // STRATA_CORE_COMMON_STATUS_H_
