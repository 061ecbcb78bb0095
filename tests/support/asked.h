// How much of a campaign a test runs: a little by default, more when asked.
#ifndef STRATA_TESTS_SUPPORT_ASKED_H_
#define STRATA_TESTS_SUPPORT_ASKED_H_

#include <cstdint>
#include <cstdlib>

#include "absl/strings/numbers.h"

namespace strata::testing {

// The number that the environment variable says, as in STRATA_KILLS=30.
inline std::uint64_t Asked(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  std::uint64_t number = 0;
  return text != nullptr && absl::SimpleAtoi(text, &number) ? number : otherwise;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_ASKED_H_
