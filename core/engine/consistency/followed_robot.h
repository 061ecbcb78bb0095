// A robot that is followed through one map: what core/tracking asks of a map, out of its served
// tiles and the places that its scans show.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_FOLLOWED_ROBOT_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_FOLLOWED_ROBOT_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/consistency/localizer.h"
#include "core/engine/consistency/surfaces_around.h"
#include "core/engine/map/map_state.h"
#include "core/engine/map/snapshots.h"
#include "core/mls/build.h"
#include "core/registration/scan_features.h"
#include "core/tracking/map_surfaces.h"
#include "core/tracking/tracker.h"
#include "core/world/map_info.h"
#include "core/world/tracking.h"

namespace strata {

// One thread at a time. Memory: while it is stepped the surfaces around the robot and one scan;
// between steps next to none.
class FollowedRobot {
 public:
  // What is asked of the map that it moves in, one at a step and maybe another one, which has the
  // same map, at the next.
  struct Around {
    const MapParameters parameters;
    SurfacesAround& surfaces;
    Localizer& localizer;
    const MapState& state;
  };

  // `start` must be valid.
  explicit FollowedRobot(const TrackStart& start);

  // By the map as it is in `around.state`. INVALID_ARGUMENT for a step that is none; DATA_LOSS for
  // no tile, those that are damaged are left out.
  absl::StatusOr<TrackedPose> Step(const TrackStep& step, const Around& around, const Stop& stop);

 private:
  class MapNow;

  absl::StatusOr<ScanFeatures> FeaturesOf(const PointCloud& cloud, const MapParameters& map);
  // Into the poses of another epoch, as the nearest scan went there.
  absl::Status Carry(const MapState& state);
  absl::StatusOr<std::shared_ptr<const MapSurfaces>> Look(const Eigen::Vector3d& p_map,
                                                          const Around& around,
                                                          const Stop& stop);

  const TrackStart start_;
  Tracker tracker_;
  std::uint64_t epoch_ = 0;  // that the tracker's pose is of
  PlaceKey seen_;            // which surfaces were seen last,
  MapView seen_view_;
  int looks_ = 0;  // how often
  MlsScratch scratch_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_FOLLOWED_ROBOT_H_
