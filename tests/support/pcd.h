// Recorded scans and their poses, as the shared data folders hold them.
#ifndef STRATA_TESTS_SUPPORT_PCD_H_
#define STRATA_TESTS_SUPPORT_PCD_H_

#include <filesystem>
#include <map>

#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::testing {

// x, y, z and rgb, where there, of a binary (not compressed) PCD file with float coordinates;
// points that are not finite are left out.
absl::StatusOr<PointCloud> ReadBinaryPcd(const std::filesystem::path& path);

struct TimedPose {
  double time_s = 0.0;
  Pose T_world_scan = Pose::Identity();
};

// By index, of a file with lines "index time x y z qx qy qz qw"; '#' begins a comment.
absl::StatusOr<std::map<int, TimedPose>> ReadIndexedPoses(const std::filesystem::path& path);

// The .pcd files of a folder by the last run of digits in their stem.
std::map<int, std::filesystem::path> ListScans(const std::filesystem::path& folder);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_PCD_H_
