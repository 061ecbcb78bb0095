// What is known of a map, as an MCAP file that Foxglove opens.
#ifndef STRATA_CLIENT_FORMATS_FOXGLOVE_FOXGLOVE_FILE_H_
#define STRATA_CLIENT_FORMATS_FOXGLOVE_FOXGLOVE_FILE_H_

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/formats/geometry_writer.h"
#include "client/formats/pose_writer.h"
#include "core/world/constraint.h"

namespace strata {

using Trajectories = std::map<std::string, std::vector<TimedPose>>;
// By name, each by time; `uploaded` or as they are now.
Trajectories TrajectoriesOf(const std::vector<PoseNode>& nodes, bool uploaded);

// All in the frame "map". What there is none of has no topic.
struct FoxgloveScene {
  // /tf has "trajectories/NAME" at every stamp (FrameTransform), /trajectories/NAME all of its
  // poses at once (PosesInFrame).
  Trajectories trajectories;
  Geometry surfaces;                  // /surfaces (PointCloud), of the vertices
  std::vector<Eigen::Vector3d> path;  // /path (PosesInFrame), each facing the next
};

// What has no time of its own is there from the first stamp on. Times before 1970 are 1970.
// RESOURCE_EXHAUSTED as PointCloudJson.
absl::StatusOr<std::string> FoxgloveBytes(const FoxgloveScene& scene);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_FOXGLOVE_FOXGLOVE_FILE_H_
