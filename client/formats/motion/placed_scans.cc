#include "client/formats/motion/placed_scans.h"

#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/formats/motion/csv_columns.h"
#include "client/formats/motion/trajectory_file.h"
#include "core/common/status.h"
#include "core/egomotion/trajectory.h"

namespace strata {

bool IsTrajectory(const std::filesystem::path& path) {
  return HasColumns(CsvHeader(path), {"time", "x", "y", "z", "qx", "qy", "qz", "qw", "c00", "c55"});
}

absl::Status PlaceOnTrajectory(const std::filesystem::path& trajectory,
                               const Pose& T_body_scan,
                               std::vector<ScanFile>& scans) {
  STRATA_ASSIGN_OR_RETURN(TrajectoryFile file, ReadTrajectory(trajectory));
  const auto way = std::make_shared<const Trajectory>(std::move(file.trajectory));
  const auto pose_at = [way, T_body_scan](double time_s) -> absl::StatusOr<Pose> {
    STRATA_ASSIGN_OR_RETURN(const TrajectoryPose pose, way->At(time_s));
    return pose.T_map_body * T_body_scan;
  };
  for (ScanFile& scan : scans) {
    scan.time = TimeOfName(scan.path);
    if (!scan.time.has_value()) {
      return absl::InvalidArgumentError(absl::StrCat(
          scan.path.string(),
          ": a trajectory gives poses to scans whose names are times in seconds, as in "
          "1432235498.028276.pcd; rename them, or give their poses as index-tum"));
    }
    const double stamp_s = absl::ToDoubleSeconds(*scan.time - absl::UnixEpoch());
    const absl::StatusOr<Pose> pose = pose_at(stamp_s);
    scan.pose_status = Annotate(pose.status(), trajectory.string());
    if (pose.ok()) scan.T_map_scan = *pose;
    scan.pose_after = [pose_at, stamp_s](double offset_s) { return pose_at(stamp_s + offset_s); };
  }
  return absl::OkStatus();
}

}  // namespace strata
