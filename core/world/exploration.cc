#include "core/world/exploration.h"

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {

absl::Status ValidateExploreQuery(const ExploreQuery& query) {
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(query.profile));
  STRATA_RETURN_IF_ERROR(ValidateClassCosts(query.class_costs));
  STRATA_RETURN_IF_ERROR(query.sensor.Validate());
  OptionChecks checks("explore");
  checks.InRange("sensor_height_m", query.sensor_height_m, 0.0, 100.0);
  checks.InRange("count", query.count, 1, 100);
  checks.InRange("budget_m", query.budget_m, 0.1, 300.0);
  checks.InRange("resolution_m", query.resolution_m, 0.01, 10.0);
  checks.InRange("bits_per_m", query.bits_per_m, 0.0, 1e6);
  checks.InRange("horizon", query.horizon, 0, 1e6);
  checks.InRange("min_bits", query.min_bits, 0.0, 1e9);
  STRATA_RETURN_IF_ERROR(checks.status());
  if (!query.region.has_value()) return absl::OkStatus();
  for (int i = 0; i < 3; ++i) {
    const double low = query.region->min()[i];
    const double high = query.region->max()[i];
    if (low >= -1e8 && high <= 1e8 && low < high) continue;
    return absl::InvalidArgumentError(
        "explore: region needs a lower corner below its upper one in x, y and z, within 1e8 m");
  }
  return absl::OkStatus();
}

absl::string_view ToString(ExploreReason reason) {
  switch (reason) {
    case ExploreReason::kViews:
      return "views";
    case ExploreReason::kExplored:
      return "explored";
    case ExploreReason::kStartNotOnSurface:
      return "start_not_on_surface";
  }
  return "unknown";
}

}  // namespace strata
