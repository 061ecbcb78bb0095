// What must hold whatever the input: where it does not, the fuzzer has found something.
#ifndef STRATA_TESTS_FUZZ_REQUIRE_H_
#define STRATA_TESTS_FUZZ_REQUIRE_H_

#include <cstdlib>
#include <iostream>

#include "absl/status/status.h"

namespace strata::fuzz {

inline void Require(bool holds, const char* what) {
  if (holds) return;
  std::cerr << "does not hold: " << what << std::endl;
  std::abort();
}

// A refusal must say why, by a code that blames the bytes and not us.
inline void RequireGoodRefusal(const absl::Status& status) {
  if (status.ok()) return;
  Require(!status.message().empty(), "an error has a message");
  Require(!absl::IsInternal(status) && !absl::IsUnknown(status), "bad bytes are not our bug");
}

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_REQUIRE_H_
