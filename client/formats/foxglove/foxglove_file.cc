#include "client/formats/foxglove/foxglove_file.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/formats/bags/mcap_writer.h"
#include "client/formats/foxglove/foxglove_messages.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr char kFrame[] = "map";
constexpr char kJson[] = "json";

std::uint64_t StampOf(const TimedPose& pose) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, absl::ToUnixNanos(pose.time)));
}

std::uint64_t FirstStamp(const FoxgloveScene& scene) {
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max();
  for (const auto& [name, poses] : scene.trajectories) {
    for (const TimedPose& pose : poses) first = std::min(first, StampOf(pose));
  }
  return first == std::numeric_limits<std::uint64_t>::max() ? 0 : first;
}

// The last as the one before.
std::vector<Pose> Facing(const std::vector<Eigen::Vector3d>& path) {
  std::vector<Pose> poses;
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i + 1 < path.size() && path[i + 1] != path[i]) {
      turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), path[i + 1] - path[i]);
    }
    poses.push_back(MakePose(turn, path[i]));
  }
  return poses;
}

absl::Status AddWhole(const FoxgloveScene& scene, McapWriter& file) {
  const std::uint64_t first_ns = FirstStamp(scene);
  if (!scene.surfaces.vertices.empty()) {
    STRATA_ASSIGN_OR_RETURN(const std::string cloud,
                            PointCloudJson(first_ns, kFrame, scene.surfaces));
    STRATA_RETURN_IF_ERROR(
        file.AddMessage(file.AddTopic("/surfaces", kPointCloudSchema, kJson), first_ns, cloud));
  }
  for (const auto& [name, timed] : scene.trajectories) {
    std::vector<Pose> poses;
    for (const TimedPose& pose : timed) poses.push_back(pose.T_map_scan);
    STRATA_RETURN_IF_ERROR(file.AddMessage(
        file.AddTopic(absl::StrCat("/trajectories/", name), kPosesInFrameSchema, kJson),
        first_ns,
        PosesInFrameJson(first_ns, kFrame, poses)));
  }
  if (scene.path.empty()) return absl::OkStatus();
  return file.AddMessage(file.AddTopic("/path", kPosesInFrameSchema, kJson),
                         first_ns,
                         PosesInFrameJson(first_ns, kFrame, Facing(scene.path)));
}

// All trajectories together, by time.
absl::Status AddTransforms(const FoxgloveScene& scene, McapWriter& file) {
  std::vector<std::tuple<std::uint64_t, const std::string*, const TimedPose*>> stamped;
  for (const auto& [name, poses] : scene.trajectories) {
    for (const TimedPose& pose : poses) stamped.emplace_back(StampOf(pose), &name, &pose);
  }
  if (stamped.empty()) return absl::OkStatus();
  std::stable_sort(stamped.begin(), stamped.end(), [](const auto& a, const auto& b) {
    return std::get<0>(a) < std::get<0>(b);
  });
  const std::uint16_t topic = file.AddTopic("/tf", kFrameTransformSchema, kJson);
  for (const auto& [stamp_ns, name, pose] : stamped) {
    STRATA_RETURN_IF_ERROR(file.AddMessage(
        topic,
        stamp_ns,
        FrameTransformJson(
            stamp_ns, kFrame, absl::StrCat("trajectories/", *name), pose->T_map_scan)));
  }
  return absl::OkStatus();
}

}  // namespace

Trajectories TrajectoriesOf(const std::vector<PoseNode>& nodes, bool uploaded) {
  std::vector<const PoseNode*> ordered;
  for (const PoseNode& node : nodes) ordered.push_back(&node);
  std::sort(ordered.begin(), ordered.end(), [](const PoseNode* a, const PoseNode* b) {
    return std::tie(a->time, a->id) < std::tie(b->time, b->id);
  });
  Trajectories trajectories;
  for (const PoseNode* node : ordered) {
    trajectories[node->id.trajectory].push_back(
        {node->time, uploaded ? node->T_map_scan_uploaded : node->T_map_scan});
  }
  return trajectories;
}

absl::StatusOr<std::string> FoxgloveBytes(const FoxgloveScene& scene) {
  McapWriter file;
  STRATA_RETURN_IF_ERROR(AddWhole(scene, file));
  STRATA_RETURN_IF_ERROR(AddTransforms(scene, file));
  return file.Finish();
}

}  // namespace strata
