// A robot that is followed through one map: what core/tracking asks of a map, out of its served
// tiles and the places that its scans show.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_FOLLOWED_ROBOT_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_FOLLOWED_ROBOT_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/consistency/localizer.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/snapshots.h"
#include "core/engine/tiles/served_tiles.h"
#include "core/mls/build.h"
#include "core/registration/scan_features.h"
#include "core/tracking/map_surfaces.h"
#include "core/tracking/tracker.h"
#include "core/world/tracking.h"

namespace strata {

// One thread at a time. Memory: the surfaces around the robot, and one scan while it is stepped.
class FollowedRobot {
 public:
  // All must outlive it; `start` must be valid.
  FollowedRobot(MapCore& core, ServedTiles& tiles, Localizer& localizer, const TrackStart& start);

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
  absl::StatusOr<MapSurfaces> Collect(const Eigen::Vector3d& centre,
                                      const MapView& view,
                                      const Stop& stop);

  MapCore& core_;
  ServedTiles& tiles_;
  Localizer& localizer_;
  const TrackStart start_;
  Tracker tracker_;
  std::uint64_t epoch_ = 0;  // that the tracker's pose is of
  std::shared_ptr<const MapSurfaces> surfaces_;
  MapView surfaces_view_;
  int looks_ = 0;  // at surfaces_
  MlsScratch scratch_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_FOLLOWED_ROBOT_H_
