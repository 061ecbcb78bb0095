// Where a robot can drive to in a map, whoever made it.
#ifndef STRATA_TESTS_EXPERIMENTS_EXPLORING_REACHED_GROUND_H_
#define STRATA_TESTS_EXPERIMENTS_EXPLORING_REACHED_GROUND_H_

#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/api/database.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata::testing {

// All places to stand that it reaches from `from`, middles of cells, sorted by x, y and z.
// NOT_FOUND where the map has no place to stand there; else errors of Tiles::Fetch.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReachedGround(api::Database& db,
                                                           absl::string_view map,
                                                           const RobotProfile& profile,
                                                           const PlanEndpoint& from);

// Those of `all` that no place of `reached` is at: in the same cell, up to 0.2 m above or below.
// Both sorted.
std::vector<Eigen::Vector3d> NotReached(const std::vector<Eigen::Vector3d>& all,
                                        const std::vector<Eigen::Vector3d>& reached);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_EXPLORING_REACHED_GROUND_H_
