// Planning: paths, surfaces at a place, robot profiles.
#ifndef STRATA_CORE_API_PLANNING_H_
#define STRATA_CORE_API_PLANNING_H_

#include <map>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/api/call.h"
#include "core/world/exploration.h"
#include "core/world/floor.h"
#include "core/world/place.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"
#include "core/world/shape.h"

namespace strata::api {

// The name under which a map's default profile is listed and changed.
inline constexpr absl::string_view kDefaultProfile = "default";

// Thread-safe.
class Planning {
 public:
  virtual ~Planning() = default;

  // A path or the reason why there is none; both are OK. INVALID_ARGUMENT for a bad query (not
  // finite, profile out of range); CANCELLED and DEADLINE_EXCEEDED from inside the search;
  // DATA_LOSS naming a damaged tile on the way.
  virtual absl::StatusOr<PlanResult> PlanPath(const Call& call,
                                              absl::string_view map,
                                              const PlanQuery& query) = 0;
  // Whether a path holds, and where it does not; both are OK. One that was just planned does.
  // INVALID_ARGUMENT for a bad query (Planner::Check in core/planning); else as PlanPath.
  virtual absl::StatusOr<PathCheck> CheckPath(const Call& call,
                                              absl::string_view map,
                                              const PathQuery& query) = 0;
  // Delivers how the path stands, at once and whenever it stops to hold or holds again, until the
  // call is stopped. Looks only when a tile changed that the path stands on, or one beside. A
  // sink's error ends the stream and is handed back. Errors of CheckPath.
  virtual absl::Status WatchPath(const Call& call,
                                 absl::string_view map,
                                 const PathQuery& query,
                                 absl::FunctionRef<absl::Status(const PathCheck&)> sink) = 0;
  // The map's floors for a robot (core/planning/floors); none is OK. INVALID_ARGUMENT for a bad
  // query; RESOURCE_EXHAUSTED for a map too large; DATA_LOSS naming a damaged tile.
  virtual absl::StatusOr<FloorPlan> ListFloors(const Call& call,
                                               absl::string_view map,
                                               const FloorQuery& query) = 0;
  // Rooms, corridors and doorways of one floor (core/classification/places); a map without floors
  // has none, which is OK. INVALID_ARGUMENT for a bad query; NOT_FOUND where no floor has the
  // number or is at the place; RESOURCE_EXHAUSTED for a floor or a map too large; DATA_LOSS naming
  // a damaged tile.
  virtual absl::StatusOr<FloorPlaces> ListPlaces(const Call& call,
                                                 absl::string_view map,
                                                 const PlaceQuery& query) = 0;
  // Where the robot should look next: views of unknown space from where it can drive, the most
  // telling first (core/world/exploration.h). That none is worth it, or that the start is on no
  // surface, is OK. INVALID_ARGUMENT for a bad query, or a region of too many voxels: the message
  // says what would fit; FAILED_PRECONDITION where the map keeps no points; DATA_LOSS naming a
  // damaged tile on the way.
  virtual absl::StatusOr<ExploreResult> Explore(const Call& call,
                                                absl::string_view map,
                                                const ExploreQuery& query) = 0;
  // Whether a shape (a mesh, boxes, cylinders and spheres) touches anything along a way, and where
  // and how deep it does (core/collision/shape_way.h); both are OK. INVALID_ARGUMENT for a bad
  // query; DATA_LOSS naming a damaged tile on the way.
  virtual absl::StatusOr<ShapeCheck> CheckShape(const Call& call,
                                                absl::string_view map,
                                                const ShapeQuery& query) = 0;
  // All levels at each place, in the order asked; a place without surfaces has an empty column.
  // DATA_LOSS naming a damaged tile where one of the places lies.
  virtual absl::StatusOr<std::vector<SurfaceColumn>> SampleSurfaces(
      const Call& call, absl::string_view map, const std::vector<Eigen::Vector2d>& places) = 0;

  // Creates or replaces. Changing kDefaultProfile re-annotates the tiles.
  virtual absl::Status SetProfile(const Call& call,
                                  absl::string_view map,
                                  absl::string_view name,
                                  const RobotProfile& profile) = 0;
  virtual absl::StatusOr<std::map<std::string, RobotProfile>> ListProfiles(
      const Call& call, absl::string_view map) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_PLANNING_H_
