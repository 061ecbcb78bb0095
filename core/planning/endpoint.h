// From a place in a query to the patch that is meant.
#ifndef STRATA_CORE_PLANNING_ENDPOINT_H_
#define STRATA_CORE_PLANNING_ENDPOINT_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/planning/explain.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {

struct EndpointMatch {
  PatchId patch = kNoPatchId;  // kNoPatchId: the robot cannot be there, and
  Explanation reason;          //   why (kUnknown: no surface there at all)
  std::string message;         //   for people
  std::optional<Eigen::Vector3d> nearest;
};

// INVALID_ARGUMENT unless the coordinates are finite and their cell is within ±2^30.
absl::Status ValidateEndpoint(absl::string_view name,
                              const PlanEndpoint& endpoint,
                              double cell_size_m);

// The surface of the endpoint's cell that `endpoint` names, if the robot can stand there: the
// level, the lowest, or the one nearest to z that is at most the robot's height from it. Otherwise
// the nearest place to stand, by horizontal distance d between (x, y) and centres of cells, then by
// height, x and y: at most radius + max_gap away, and
//   with z         within max_step + tan(max_slope) · d of it, or of the named surface
//   with a level   on the surface of that level in its cell
//   with neither   on the lowest surface of its cell.
// Failing that, with z, the highest surface of the cell at or below z on which the robot can stand
// and reaches z: z may be a sensor's, and a ceiling nearer to it than the floor. Never another
// storey: `message` then says where the nearest place to stand is, of the 64 tiles around with
// anything in them, and how far from z.
absl::StatusOr<EndpointMatch> MatchEndpoint(SearchSpace& space, const PlanEndpoint& endpoint);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_ENDPOINT_H_
