#include "core/common/map_owner.h"

#include <string>

#include "absl/strings/cord.h"

namespace strata {
namespace {

constexpr char kMapOwnerUrl[] = "strata/map_owner";

}  // namespace

absl::Status WithMapOwner(absl::Status status, absl::string_view owner) {
  status.SetPayload(kMapOwnerUrl, absl::Cord(owner));
  return status;
}

std::optional<std::string> MapOwnerOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kMapOwnerUrl);
  if (!payload.has_value()) return std::nullopt;
  return std::string(*payload);
}

}  // namespace strata
