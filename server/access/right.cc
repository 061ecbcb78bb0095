#include "server/access/right.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace strata::server {

absl::string_view RightName(Right right) {
  switch (right) {
    case Right::kRead:
      return "read";
    case Right::kWrite:
      return "write";
    case Right::kAdmin:
      return "admin";
  }
  return "unknown";
}

std::optional<Right> ParseRight(absl::string_view name) {
  for (const Right right : {Right::kRead, Right::kWrite, Right::kAdmin}) {
    if (name == RightName(right)) return right;
  }
  return std::nullopt;
}

std::string Grant::RightsText() const {
  return absl::StrJoin(maps, " ", [](std::string* text, const auto& entry) {
    absl::StrAppend(text, entry.first, ":", RightName(entry.second));
  });
}

bool Grant::Allows(Right right, absl::string_view map) const {
  const auto at_least = [&](absl::string_view key) {
    const auto found = maps.find(std::string(key));
    return found != maps.end() && found->second >= right;
  };
  return at_least(kAllMaps) || at_least(map);
}

}  // namespace strata::server
