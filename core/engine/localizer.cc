#include "core/engine/localizer.h"

namespace strata {

absl::StatusOr<LocalizeResult> Localizer::Localize(const LocalizeQuery&, const Stop&) {
  return absl::UnimplementedError("soon");
}

}  // namespace strata
