#include "tests/support/paths.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata::testing {

std::string SourcePath(absl::string_view file) {
  return absl::StrCat(STRATA_SOURCE_DIR, "/", file);
}

std::string BuiltPath(absl::string_view file) { return absl::StrCat(STRATA_BUILD_DIR, "/", file); }

}  // namespace strata::testing
