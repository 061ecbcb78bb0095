// Where the clouds of a robot were taken, and the clouds as scans of a map: the same for recordings
// and for robots that are driving.
#ifndef STRATA_CLIENT_FORMATS_BAGS_CLOUD_POSES_H_
#define STRATA_CLIENT_FORMATS_BAGS_CLOUD_POSES_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "client/formats/bags/ros_topic.h"
#include "client/formats/bags/transform_tree.h"
#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

// Whose poses in which frame there are: "odom" and "base_link". The base is empty where a topic of
// poses does not say whose they are: the clouds' own then.
struct PoseFrames {
  std::string fixed, base;
};

// "tf:odom->base_link", or with "→"; INVALID_ARGUMENT otherwise.
absl::StatusOr<PoseFrames> ParseTransformPoses(absl::string_view text);

// A cloud's pose, and what moves its points into the frame whose pose that is.
struct CloudPose {
  Pose T_map_scan = Pose::Identity();
  std::optional<Pose> T_scan_cloud;
};

// Of a cloud in `frame`, where the base was at T_map_base at that stamp. The points stay in the
// frame of the sensor, whose place on the base becomes part of the pose; a cloud in a frame that
// the base moves in is moved to the base. `T_base_cloud` goes before what the transforms say.
// NOT_FOUND where they say nothing.
absl::StatusOr<CloudPose> PoseOfCloud(const Pose& T_map_base,
                                      const PoseFrames& frames,
                                      const std::optional<Pose>& T_base_cloud,
                                      const std::string& frame,
                                      std::int64_t stamp_ns,
                                      TransformTree& transforms);

// A message of sensor_msgs/PointCloud2 as points of a scan: returns of range 0 left out and
// counted, and moved as CloudPose has it. INVALID_ARGUMENT as ReadRosCloud and ValidateCloud.
absl::StatusOr<PointCloud> ScanOfMessage(absl::string_view message,
                                         MessageEncoding encoding,
                                         const std::optional<Pose>& T_scan_cloud,
                                         std::size_t* at_sensor);

// To the nearest microsecond, as times of files of poses come.
absl::Time TimeOfStamp(std::int64_t stamp_ns);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_CLOUD_POSES_H_
