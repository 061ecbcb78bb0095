#include "core/world/names.h"

#include <algorithm>
#include <cstddef>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata {

absl::Status ValidateName(absl::string_view what, absl::string_view name) {
  constexpr std::size_t kMaxLength = 100;
  const auto allowed = [](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '_' || c == '.' || c == '-';
  };
  if (!name.empty() && name.size() <= kMaxLength && name.front() != '.' && name.front() != '-' &&
      std::all_of(name.begin(), name.end(), allowed)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(what,
                                                 " '",
                                                 absl::CHexEscape(name.substr(0, kMaxLength)),
                                                 "': use 1 to 100 of A-Z a-z 0-9 _ . -, starting "
                                                 "with a letter, digit or _"));
}

}  // namespace strata
