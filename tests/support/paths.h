// Where the checkout's files and this build's programs are, for tests that read or run them. Only
// paths.cc is compiled with these places, so that the compiler cache knows all else in any
// checkout.
#ifndef STRATA_TESTS_SUPPORT_PATHS_H_
#define STRATA_TESTS_SUPPORT_PATHS_H_

#include <string>

#include "absl/strings/string_view.h"

namespace strata::testing {

// `file` relative to the root of the checkout; absolute.
std::string SourcePath(absl::string_view file);
// `file` relative to the build folder; absolute.
std::string BuiltPath(absl::string_view file);

// The programs as their users have them.
inline std::string StratadProgram() { return BuiltPath("server/stratad"); }
inline std::string StrataProgram() { return BuiltPath("client/cli/strata"); }
inline std::string Ros2Program() { return BuiltPath("client/ros2/strata-ros2"); }

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_PATHS_H_
