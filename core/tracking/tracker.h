// Follows one robot through a map: predicted by odometry, registered to the map's surfaces, and
// found again among all places where it was lost.
#ifndef STRATA_CORE_TRACKING_TRACKER_H_
#define STRATA_CORE_TRACKING_TRACKER_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/registration/mls_registration.h"
#include "core/registration/scan_features.h"
#include "core/tracking/map_surfaces.h"
#include "core/tracking/pose_filter.h"
#include "core/world/localization.h"
#include "core/world/tracking.h"

namespace strata {

// A map as a tracker asks it, in one epoch.
class TrackedMap {
 public:
  virtual ~TrackedMap() = default;
  // What lies within kTrackedRangeM of a place, not null.
  virtual absl::StatusOr<std::shared_ptr<const MapSurfaces>> Around(
      const Eigen::Vector3d& p_map) = 0;
  // Where the scan at hand was taken: near the guess, or anywhere without one.
  virtual absl::StatusOr<LocalizeResult> Find(const std::optional<Pose>& T_map_scan_guess,
                                              double guess_radius_m) = 0;
};

// A function of what it was given, in that order. One thread at a time.
class Tracker {
 public:
  // Scans in a row that do not agree with the map until the robot is looked for.
  static constexpr int kMissesUntilLost = 2;

  // `start` and `registration` must be valid.
  Tracker(const TrackStart& start, const MlsRegistrationOptions& registration)
      : start_(start), registration_(registration) {}

  // The robot's next moment; `features` of step.cloud, empty where that is. Errors are those of the
  // map; what odometry said counts nevertheless. Does not set TrackedPose::epoch.
  absl::StatusOr<TrackedPose> Step(const TrackStep& step,
                                   const ScanFeatures& features,
                                   TrackedMap& map);
  // The pose as it is known; nullopt before the robot was found for the first time.
  std::optional<Pose> pose() const;
  // The map has moved there.
  void Move(const Pose& T_new_old);

 private:
  // A scan beside the map.
  struct Look {
    bool agrees = false;
    Pose T_map_scan = Pose::Identity();
    Matrix6d information = Matrix6d::Zero();
    double overlap = 0.0;
    double contradiction = 0.0;
    double rms_m = 0.0;
    double map_scale = 1.0;  // of the map's errors there, beside usual ones
    std::string why_not;
  };

  void Predict(const TrackStep& step);
  absl::StatusOr<Look> LookFrom(const Pose& T_map_scan_guess,
                                const ScanFeatures& features,
                                TrackedMap& map) const;
  // The same, and whether odometry allows for it.
  absl::StatusOr<Look> LookAhead(const ScanFeatures& features, TrackedMap& map) const;
  // A place for a robot that is lost; `pose` tells about it. False: none.
  absl::StatusOr<bool> FindAgain(const ScanFeatures& features, TrackedMap& map, TrackedPose& pose);
  absl::StatusOr<bool> TryPlace(const std::optional<Pose>& guess,
                                double radius_m,
                                const ScanFeatures& features,
                                TrackedMap& map,
                                TrackedPose& pose);
  bool ToBeLookedFor() const;
  void Believe(const Look& look);
  static void Tell(const Look& look, TrackedPose& pose);
  TrackedPose Answer(TrackedPose pose) const;

  TrackStart start_;  // its guess goes along with odometry
  const MlsRegistrationOptions registration_;
  std::optional<PoseFilter> filter_;  // nullopt: never found
  std::optional<Pose> T_odom_last_;
  double map_scale_ = 1.0;  // of the last scan that was believed
  int misses_ = 0;          // scans in a row that did not agree
};

}  // namespace strata

#endif  // STRATA_CORE_TRACKING_TRACKER_H_
