// Why a robot cannot be somewhere or go on.
#ifndef STRATA_CORE_PLANNING_EXPLAIN_H_
#define STRATA_CORE_PLANNING_EXPLAIN_H_

#include <string>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {

struct Explanation {
  Obstruction kind = Obstruction::kNone;
  double value = 0.0;  // see Obstruction
  Eigen::Vector3d where = Eigen::Vector3d::Zero();

  // "step of 0.31 m at (1.05, 2.15, 0.00)".
  std::string ToString() const;
};

// Why the robot cannot stand on `patch`; kNone if it can.
absl::StatusOr<Explanation> WhyNotStand(SearchSpace& space, PatchId patch);

// Of all patches that the last search of `workspace` reached and that a move is refused from, the
// one nearest to `goal`, and why it does not go on there towards the goal.
absl::StatusOr<Explanation> WhyNoFurther(SearchSpace& space,
                                         const SearchWorkspace& workspace,
                                         PatchId goal);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_EXPLAIN_H_
