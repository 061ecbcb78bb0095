#include "core/world/place.h"

namespace strata {

absl::string_view ToString(PlaceKind kind) {
  switch (kind) {
    case PlaceKind::kRoom:
      return "room";
    case PlaceKind::kCorridor:
      return "corridor";
    case PlaceKind::kDoorway:
      return "doorway";
  }
  return "unknown";
}

}  // namespace strata
