// A robot that is followed through a map by its odometry and its scans (thesis 10, "next step":
// maps are useful for localisation).
#ifndef STRATA_CORE_WORLD_TRACKING_H_
#define STRATA_CORE_WORLD_TRACKING_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/world/localization.h"

namespace strata {

struct TrackStart {
  std::optional<SensorModel> sensor;  // default: the map's
  // Where the first scan was taken, roughly; without it, anywhere.
  std::optional<Pose> T_map_scan_guess;
  double guess_radius_m = 20.0;  // in (0, kMaxGuessRadiusM]
};

// INVALID_ARGUMENT naming what is wrong.
absl::Status ValidateTrackStart(const TrackStart& start);

// One moment of the robot.
struct TrackStep {
  // In the scan frame, with the sensor's origin. Without points: odometry alone.
  PointCloud cloud;
  // Where odometry says that the scan was taken, in a frame of its own that does not jump.
  Pose T_odom_scan = Pose::Identity();
  // Of a right-hand step on the motion since the step before, [rad², m²]; symmetric and positive
  // definite. Default: MotionCovariance() in core/tracking.
  std::optional<Matrix6d> motion_covariance;
};

// INVALID_ARGUMENT for a pose or covariance that is none, an origin or grid that does not fit, or
// points that are not valid (ValidateCloud).
absl::Status ValidateTrackStep(const TrackStep& step);
// The same, but for the points.
absl::Status ValidateTrackMotion(const TrackStep& step);

enum class TrackState : std::uint8_t {
  kTracked,    // the scan agrees with the map there
  kPredicted,  // by odometry alone: without points, or this scan does not agree with the map
  kLost,       // several scans do not, and no place was found
};
// "tracked", "predicted", "lost".
absl::string_view ToString(TrackState state);

struct TrackedPose {
  TrackState state = TrackState::kLost;
  // Some pose is known: of a robot that is lost the one that odometry makes of the last it was
  // tracked at; false until it was for the first time.
  bool known = false;
  Pose T_map_scan = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();  // of a right-hand step on the pose; rad², m²; 0: unknown
  // overlap · (1 − contradiction / the bound), in [0, 1]: how well the scan agrees with the map at
  // the pose. 0 unless tracked.
  double score = 0.0;
  // Of the scan at the pose that it was matched at, whether that was believed or not: share of what
  // the scan shows near by that the map has, and of what the map has there that it looked through.
  double overlap = 0.0;
  double contradiction = 0.0;
  double rms_m = 0.0;
  bool found = false;       // among all places, by this scan
  std::uint64_t epoch = 0;  // of the map that the pose is of
  std::string message;      // for people: why it is not tracked, or how it was found
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_TRACKING_H_
