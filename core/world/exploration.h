// Where a robot should look next (thesis 4.4.2).
#ifndef STRATA_CORE_WORLD_EXPLORATION_H_
#define STRATA_CORE_WORLD_EXPLORATION_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/field_of_view.h"
#include "core/geometry/pose.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata {

// Voxels of the space that one query looks at: 160 MB where all are known.
inline constexpr std::uint64_t kMaxExploreVoxels = 40'000'000;

struct ExploreQuery {
  PlanEndpoint from;  // where the robot is
  RobotProfile profile;
  ClassCosts class_costs = {};
  InferredAs inferred = InferredAs::kIgnore;  // on the way; what is to be learnt stays unknown
  FieldOfView sensor = {};
  double sensor_height_m = 1.0;  // over the surface that the robot stands on; in [0, 100]
  int count = 5;                 // views at most; in [1, 100]
  double budget_m = 30.0;        // no stand costs more than that [m of good ground]; in [0.1, 300]
  double resolution_m = 0.2;     // of the occupancy grid; in [0.01, 10]
  // Of which something is to be learnt, as far as the sensor may see it. Absent: what the sensor
  // may see from places within the budget, from 1 m below the lowest to 1 m above robot and sensor
  // at the highest.
  std::optional<Eigen::AlignedBox3d> region = std::nullopt;
  double bits_per_m = 10.0;  // λ of eq. 4.15: what a metre of the way has to be worth; in [0, 1e6]
  int horizon = 0;           // looks at so many of the nearest stands first; 0: at all; ≥ 0
  double min_bits = 100.0;   // u_min: views worth less are left out; in [0, 1e9]
};

// INVALID_ARGUMENT naming what is not finite or out of its range, the endpoint aside.
absl::Status ValidateExploreQuery(const ExploreQuery& query);

struct ExploreView {
  Pose T_map_sensor;                                // upright
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // on the surface below it
  // Expected of it, after those before (eq. 4.13), unseen ground ten times.
  double gain_bits = 0.0;
  double volume_m3 = 0.0;     // unknown space that is known then
  double cost_m = 0.0;        // of the way there from the view before; see PlanResult::cost
  double utility_bits = 0.0;  // eq. 4.15
};

enum class ExploreReason : std::uint8_t {
  kViews = 0,
  kExplored = 1,           // no view in reach is worth min_bits
  kStartNotOnSurface = 2,  // nearest: where the robot could stand
};

struct ExploreResult {
  ExploreReason reason = ExploreReason::kViews;
  std::string message;             // for people, with numbers
  std::vector<ExploreView> views;  // in the order in which to drive to them
  std::uint64_t stands = 0;        // places that were compared
  Eigen::AlignedBox3d region;      // that was looked at; empty where the start is on no surface
  double known_m3 = 0.0;           // of it, free or occupied
  double region_m3 = 0.0;
  std::uint64_t scans = 0;           // whose rays it is known by
  std::uint64_t scans_left_out = 0;  // that may have seen it, but whose points are gone or damaged
  std::optional<Eigen::Vector3d> nearest;
  double elapsed_ms = 0.0;
  std::uint64_t epoch = 0;
};

// "views", "explored", "start_not_on_surface".
absl::string_view ToString(ExploreReason reason);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_EXPLORATION_H_
