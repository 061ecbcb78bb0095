#include "core/world/plan.h"

#include "absl/strings/string_view.h"

namespace strata {

absl::string_view ToString(PlanReason reason) {
  switch (reason) {
    case PlanReason::kFound:
      return "found";
    case PlanReason::kStartNotOnSurface:
      return "start_not_on_surface";
    case PlanReason::kGoalNotOnSurface:
      return "goal_not_on_surface";
    case PlanReason::kBlocked:
      return "blocked";
    case PlanReason::kUnknownGround:
      return "unknown_ground";
    case PlanReason::kSearchLimit:
      return "search_limit";
  }
  return "unknown";
}

absl::string_view ToString(Obstruction obstruction) {
  switch (obstruction) {
    case Obstruction::kNone:
      return "none";
    case Obstruction::kStep:
      return "step";
    case Obstruction::kSlope:
      return "slope";
    case Obstruction::kClearance:
      return "clearance";
    case Obstruction::kDrop:
      return "drop";
    case Obstruction::kObstacle:
      return "obstacle";
    case Obstruction::kRoughness:
      return "roughness";
    case Obstruction::kUnknown:
      return "unknown";
  }
  return "unknown";
}

}  // namespace strata
