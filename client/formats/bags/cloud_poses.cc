#include "client/formats/bags/cloud_poses.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"

#include "client/formats/bags/ros_messages.h"
#include "client/formats/parsing/range_zero.h"
#include "core/common/status.h"

namespace strata {
namespace {

absl::StatusOr<Pose> FromBase(const PoseFrames& frames,
                              const std::string& frame,
                              std::int64_t stamp_ns,
                              TransformTree& transforms) {
  absl::StatusOr<Pose> T = transforms.Lookup(frames.base, frame, stamp_ns);
  if (T.ok()) return T;
  return absl::NotFoundError(absl::StrCat("the clouds are in frame ",
                                          frame,
                                          ", the poses are those of ",
                                          frames.base,
                                          ": ",
                                          T.status().message(),
                                          "; /tf_static is needed, too, or say where the sensor is "
                                          "on the base with --mount X,Y,Z[,YAW]"));
}

// Floats as near to the truth as they can be: through doubles.
PointCloud Moved(PointCloud cloud, const Pose& T) {
  for (Eigen::Vector3f& p : cloud.points) {
    p = (T * (cloud.origin + p.cast<double>())).cast<float>();
  }
  cloud.origin.setZero();
  cloud.sensor_origin.setZero();
  return cloud;
}

}  // namespace

absl::StatusOr<PoseFrames> ParseTransformPoses(absl::string_view text) {
  absl::string_view spec = text;
  const bool transforms = absl::ConsumePrefix(&spec, "tf:");
  const absl::string_view arrow = absl::StrContains(spec, "→") ? "→" : "->";
  const std::pair<std::string, std::string> sides = absl::StrSplit(spec, absl::MaxSplits(arrow, 1));
  if (!transforms || sides.first.empty() || sides.second.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text.substr(0, 100), "' names no two frames: tf:odom->base_link"));
  }
  return PoseFrames{sides.first, sides.second};
}

absl::StatusOr<CloudPose> PoseOfCloud(const Pose& T_map_base,
                                      const PoseFrames& frames,
                                      const std::optional<Pose>& T_base_cloud,
                                      const std::string& frame,
                                      std::int64_t stamp_ns,
                                      TransformTree& transforms) {
  if (T_base_cloud.has_value()) return CloudPose{Normalized(T_map_base * *T_base_cloud), {}};
  if (frame == frames.fixed) return CloudPose{T_map_base, T_map_base.inverse()};
  if (frames.base.empty() || frame == frames.base) return CloudPose{T_map_base, {}};
  STRATA_ASSIGN_OR_RETURN(const Pose T, FromBase(frames, frame, stamp_ns, transforms));
  if (transforms.HangsFrom(frames.base, frame)) return CloudPose{T_map_base, T};
  return CloudPose{Normalized(T_map_base * T), {}};
}

absl::StatusOr<PointCloud> ScanOfMessage(absl::string_view message,
                                         MessageEncoding encoding,
                                         const std::optional<Pose>& T_scan_cloud,
                                         std::size_t* at_sensor) {
  STRATA_ASSIGN_OR_RETURN(PointCloud read, ReadRosCloud(message, encoding));
  STRATA_ASSIGN_OR_RETURN(read, WithoutRangeZero(std::move(read), at_sensor));
  if (!T_scan_cloud.has_value()) return read;
  PointCloud moved = Moved(std::move(read), *T_scan_cloud);
  STRATA_RETURN_IF_ERROR(ValidateCloud(moved));
  return moved;
}

absl::Time TimeOfStamp(std::int64_t stamp_ns) {
  constexpr std::int64_t kMicrosecondNs = 1000;
  const std::int64_t floor_us = stamp_ns / kMicrosecondNs - (stamp_ns % kMicrosecondNs < 0 ? 1 : 0);
  const std::int64_t rest_ns = stamp_ns - floor_us * kMicrosecondNs;
  return absl::FromUnixMicros(floor_us + (2 * rest_ns >= kMicrosecondNs ? 1 : 0));
}

}  // namespace strata
