// Questions of planners and their answers.
#ifndef STRATA_CORE_WORLD_PLAN_H_
#define STRATA_CORE_WORLD_PLAN_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/world/robot_profile.h"

namespace strata {

// A place on a surface: the one nearest in height to `z_m`, at most the robot's height from it, or
// the `level`-th from below (0 = lowest). Neither: the lowest.
struct PlanEndpoint {
  double x_m = 0.0;
  double y_m = 0.0;
  std::optional<double> z_m = std::nullopt;
  std::optional<int> level = std::nullopt;
};

// By what the cost of crossing surfaces of a class is multiplied, by class id in [1, 255]: in
// [1, kMaxClassFactor], or kForbiddenClass. Classes that are not there cost what their ground does.
using ClassCosts = std::map<int, double>;
inline constexpr double kMaxClassFactor = 100.0;
// The robot's centre never is over a surface of the class.
inline constexpr double kForbiddenClass = std::numeric_limits<double>::infinity();

// INVALID_ARGUMENT naming the class whose id or factor is out of range.
absl::Status ValidateClassCosts(const ClassCosts& costs);

// What nobody saw of things, by what others of their kinds look like
// (core/world/things/inferred.h), is to a robot.
enum class InferredAs : std::uint8_t {
  kIgnore = 0,
  kObstacle = 1,  // as what was measured, but nobody stands on it
};

struct PlanQuery {
  PlanEndpoint from;
  PlanEndpoint to;
  RobotProfile profile;
  ClassCosts class_costs = {};
  std::uint64_t max_expanded = 50'000'000;  // search limit
  InferredAs inferred = InferredAs::kIgnore;
};

enum class PlanReason : std::uint8_t {
  kFound = 0,
  kStartNotOnSurface = 1,  // nearest: where a robot could stand
  kGoalNotOnSurface = 2,
  kBlocked = 3,        // where and by what the search came to an end closest to the goal
  kUnknownGround = 4,  // the way out of the reached region leads over unobserved cells only
  kSearchLimit = 5,
};

// What stops the robot at a place.
enum class Obstruction : std::uint8_t {
  kNone = 0,
  kStep = 1,       // value: height of the step [m]
  kSlope = 2,      // value: angle [rad]
  kClearance = 3,  // value: height that is free [m]
  kDrop = 4,       // value: depth of the drop within the radius [m]
  kObstacle = 5,   // value: height of what stands within the radius [m]
  kRoughness = 6,  // value: σ around the local plane [m]
  kUnknown = 7,    // value: width of the unobserved stretch [m]
  kClass = 8,      // value: id of a forbidden class
};

// A stretch of unobserved cells that the path bridges.
struct PlanGap {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double length_m = 0.0;
};

// A path, or why there is none.
struct PlanResult {
  PlanReason reason = PlanReason::kFound;
  std::string message;                     // for people, with numbers
  std::vector<Eigen::Vector3d> waypoints;  // on the surfaces, in the map frame; empty unless found
  double length_m = 0.0;
  double cost = 0.0;  // Σ length · (1 + danger) · factor of the class [m]
  // Cost of the cheapest path from patch to patch, before it was pulled straight; ≥ cost.
  double graph_cost = 0.0;
  std::vector<PlanGap> gaps;
  std::uint64_t expanded = 0;
  double elapsed_ms = 0.0;
  std::uint64_t epoch = 0;
  std::vector<TileKey> tiles;  // that the path stands on
  // If not found: where the trouble is, of what kind and how much (see Obstruction), and for an
  // endpoint that is not on a surface the nearest place where a robot could stand.
  std::optional<Eigen::Vector3d> where;
  Obstruction obstruction = Obstruction::kNone;
  double obstruction_value = 0.0;
  bool inferred = false;  // nobody measured it: it is there by what was inferred
  std::optional<Eigen::Vector3d> nearest;

  bool found() const { return reason == PlanReason::kFound; }
};

// Whether a path holds, and where it does not.
struct PathCheck {
  bool valid = true;
  std::string message;    // for people, with numbers
  double valid_m = 0.0;   // along the waypoints, as far as it holds
  double length_m = 0.0;  // of all of it
  // If it does not hold: what is in the way behind valid_m, of what kind and how much (see
  // Obstruction).
  std::optional<Eigen::Vector3d> where;
  Obstruction obstruction = Obstruction::kNone;
  double obstruction_value = 0.0;
  bool inferred = false;  // as of PlanResult
  std::uint64_t epoch = 0;
  std::uint64_t commit_sequence = 0;  // the state of the map that it is about
  std::vector<TileKey> tiles;         // that the path crosses, sorted
};

// Asks whether a path still holds.
struct PathQuery {
  std::vector<Eigen::Vector3d> waypoints;  // on the surfaces, in the map frame
  RobotProfile profile;
  ClassCosts class_costs = {};  // only what is forbidden counts
  // The answer to the same question before: where nothing that it stands on changed since, it is
  // the answer again, at once.
  std::optional<PathCheck> known = std::nullopt;
  InferredAs inferred = InferredAs::kIgnore;
};

// The longest path that is checked.
inline constexpr std::size_t kMaxWaypoints = 100'000;
inline constexpr std::size_t kMaxPathTiles = 10'000;

// All surfaces at one place, lowest first.
struct SurfaceColumn {
  double x_m = 0.0;
  double y_m = 0.0;
  std::vector<Surface> surfaces;
};

// Lower-case words as in the API and the CLI: "found", "start_not_on_surface", …; "step", "slope",
// …
absl::string_view ToString(PlanReason reason);
absl::string_view ToString(Obstruction obstruction);
// "ignore", "obstacle", as the CLI has them.
absl::string_view ToString(InferredAs as);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_PLAN_H_
