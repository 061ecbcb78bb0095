#include "core/world/plan.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata {

absl::Status ValidateClassCosts(const ClassCosts& costs) {
  for (const auto& [id, factor] : costs) {
    if (id < 1 || id > 255) {
      return absl::InvalidArgumentError(
          absl::StrCat("class_costs: class ", id, " is not in [1, 255]"));
    }
    if (factor != kForbiddenClass && !(factor >= 1.0 && factor <= kMaxClassFactor)) {
      return absl::InvalidArgumentError(absl::StrCat("class_costs: factor ",
                                                     factor,
                                                     " of class ",
                                                     id,
                                                     " is not in [1, ",
                                                     kMaxClassFactor,
                                                     "] and not forbidden"));
    }
  }
  return absl::OkStatus();
}

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
    case Obstruction::kClass:
      return "class";
  }
  return "unknown";
}

absl::string_view ToString(InferredAs as) {
  return as == InferredAs::kObstacle ? "obstacle" : "ignore";
}

}  // namespace strata
