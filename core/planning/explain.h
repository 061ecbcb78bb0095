// Why a robot cannot be somewhere or go on.
#ifndef STRATA_CORE_PLANNING_EXPLAIN_H_
#define STRATA_CORE_PLANNING_EXPLAIN_H_

#include <string>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {

// How far beyond a refused move its other side is looked for [m].
inline constexpr double kLookAheadM = 5.0;

struct Explanation {
  Obstruction kind = Obstruction::kNone;
  double value = 0.0;  // see Obstruction
  Eigen::Vector3d where = Eigen::Vector3d::Zero();
  bool inferred = false;  // nobody measured it

  // "step of 0.31 m at (1.05, 2.15, 0.00)"; "inferred obstacle of …".
  std::string ToString() const;
};

// Why the robot cannot stand on `patch`; kNone if it can.
absl::StatusOr<Explanation> WhyNotStand(SearchSpace& space, PatchId patch);

// Why the robot cannot go from `patch` in `direction`; kNone if it can.
absl::StatusOr<Explanation> WhyNoMove(SearchSpace& space, PatchId patch, int direction);

// The edge nearest to the centre of `patch` that is nearer than within_m; kNone if none is.
absl::StatusOr<Explanation> WhyTooNear(SearchSpace& space, PatchId patch, double within_m);

// Why the last search of `workspace` did not get on towards `goal`: the refused move nearest to it
//   - that leads, straight on for at most kLookAheadM, from cell to cell within the robot's height,
//     over holes wider than max_gap within a slope that it takes and behind walls within a step,
//     to ground connected to the goal; or,
//     if there is none,
//   - that leads to unobserved ground; or, if there is none,
//   - at all: its end is the top of a wall, say, or another storey.
absl::StatusOr<Explanation> WhyNoFurther(SearchSpace& space,
                                         const SearchWorkspace& workspace,
                                         PatchId goal,
                                         const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_EXPLAIN_H_
