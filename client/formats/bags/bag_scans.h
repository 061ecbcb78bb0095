// Scans to import out of a recording: clouds, or lines of a laser, of one topic, with poses of
// another.
#ifndef STRATA_CLIENT_FORMATS_BAGS_BAG_SCANS_H_
#define STRATA_CLIENT_FORMATS_BAGS_BAG_SCANS_H_

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/formats/bags/keyframes.h"
#include "client/formats/scan_list.h"
#include "core/geometry/pose.h"

namespace strata {

// Both scanners of the thesis turn once in it.
inline constexpr double kDefaultSweepS = 2.0;

struct BagScanOptions {
  // Of clouds or of a laser; empty: the only one of clouds or, where there are none, of a laser.
  std::string topic = {};
  // A topic of poses, or "tf:FIXED→BASE" (or "->"); empty: the only topic of poses.
  std::string poses_from = {};
  KeyframeSpacing every = {};
  // Where the clouds' frame is in that whose poses they are; without it as the transforms say.
  std::optional<Pose> T_base_cloud = {};
  // A robot description (URDF), whose joints move as messages of sensor_msgs/JointState say; empty:
  // none.
  std::string urdf = {};
  // Lines of a laser in so many seconds make a scan; more than 0. Unset: kDefaultSweepS.
  std::optional<double> sweep_s = {};
  // Told, if set, what was chosen, and, after "warning: ", what is no error but may not be what was
  // meant.
  std::function<void(const std::string&)> tell = {};
  // Told, if set, what share of the recording has been read; an error of it ends that.
  std::function<absl::Status(double)> progress = {};
};

// The keyframes among the clouds, in the order of their stamps. Their sequence is their number
// among all clouds of the topic that have points, so that it does not depend on `every`; their time
// is the stamp, to the microsecond; their pose is interpolated (PoseTrack::At). The points stay in
// the frame of the sensor, whose place on the base becomes part of the pose; clouds in a frame that
// the base moves in (the fixed one, odom), as LiDAR odometries publish them, are moved to the base.
// What reads a cloud holds the recording open. Poses after a cloud's stamp are known where its
// points have times and are in the sensor's frame.
//
// Of a laser (sensor_msgs/LaserScan) that turns or tilts the lines of each sweep are a scan, in the
// frame of the base at its middle (ReadSweep); the sequence is the number of the sweep since the
// first line.
//
// Clouds without a pose are left out and told. INVALID_ARGUMENT, NOT_FOUND saying what there is and
// what to type: a topic that is not there, of another type or one of several, frames that nothing
// connects, no cloud with a pose, a file that is no robot description, a sweep for clouds.
absl::StatusOr<std::vector<ScanFile>> ListBagScans(const std::vector<std::filesystem::path>& paths,
                                                   const BagScanOptions& options);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_BAG_SCANS_H_
