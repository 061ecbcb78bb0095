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
#include "core/engine/map/map_core.h"
#include "core/engine/map/snapshots.h"
#include "core/mls/build.h"
#include "core/registration/scan_features.h"
#include "core/tracking/map_surfaces.h"
#include "core/tracking/tracker.h"
#include "core/world/tracking.h"

namespace strata {

// One thread at a time. Memory: while it is stepped the surfaces around the robot and one scan;
// between steps next to none.
class FollowedRobot {
 public:
  // All must outlive it; `start` must be valid.
  FollowedRobot(MapCore& core,
                SurfacesAround& surfaces,
                Localizer& localizer,
                const TrackStart& start);

  // By the map as it is now. INVALID_ARGUMENT for a step that is none; DATA_LOSS for no tile, those
  // that are damaged are left out.
  absl::StatusOr<TrackedPose> Step(const TrackStep& step, const Stop& stop);

 private:
  class MapNow;

  absl::StatusOr<ScanFeatures> FeaturesOf(const PointCloud& cloud);
  // Into the poses of another epoch, as the nearest scan went there.
  absl::Status Carry(std::uint64_t epoch);
  absl::StatusOr<std::shared_ptr<const MapSurfaces>> Around(const Eigen::Vector3d& p_map,
                                                            const MapView& view,
                                                            const Stop& stop);

  MapCore& core_;
  SurfacesAround& surfaces_;
  Localizer& localizer_;
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
