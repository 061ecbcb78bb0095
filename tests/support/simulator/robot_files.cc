#include "tests/support/simulator/robot_files.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"

namespace strata::testing {
namespace {

std::string IndexTum(const std::vector<Pose>& poses, const std::string& comment) {
  std::string text = absl::StrCat("# ", comment, "\n# index time x y z qx qy qz qw\n");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d t = poses[i].translation();
    const Eigen::Quaterniond q(poses[i].linear());
    absl::StrAppendFormat(&text,
                          "%d %.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                          i,
                          static_cast<double>(i),
                          t.x(),
                          t.y(),
                          t.z(),
                          q.x(),
                          q.y(),
                          q.z(),
                          q.w());
  }
  return text;
}

}  // namespace

absl::StatusOr<WrittenRobot> WriteRobot(const Scene& scene,
                                        const Robot& robot,
                                        std::uint64_t seed,
                                        const RobotFiles& files,
                                        const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "scans");
  std::vector<Pose> truth = Drive(scene, robot.waypoints, files.step_m, files.height_m);
  truth.resize(std::min(truth.size(), files.max_scans));
  STRATA_RETURN_IF_ERROR(
      WriteFileBytes(folder / "poses_truth.txt", IndexTum(truth, "exact, simulated")));
  STRATA_RETURN_IF_ERROR(
      WriteFileBytes(folder / "poses_initial.txt",
                     IndexTum(NoisyOdometry(truth, files.noise, seed), "odometry, simulated")));
  WrittenRobot written{truth.size(), 0};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const PointCloud cloud = SimulateScan(scene, files.sensor, truth[i], seed + 1000003 * (i + 1));
    written.points += cloud.size();
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, PcdBytes(GeometryOf(cloud)));
    STRATA_RETURN_IF_ERROR(
        WriteFileBytes(folder / "scans" / absl::StrFormat("scan%04d.pcd", i), bytes));
  }
  return written;
}

}  // namespace strata::testing
