#include "client/formats/motion/placed_scans.h"

#include <filesystem>
#include <optional>
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
  STRATA_ASSIGN_OR_RETURN(const TrajectoryFile file, ReadTrajectory(trajectory));
  for (ScanFile& scan : scans) {
    scan.time = TimeOfName(scan.path);
    if (!scan.time.has_value()) {
      return absl::InvalidArgumentError(absl::StrCat(
          scan.path.string(),
          ": a trajectory gives poses to scans whose names are times in seconds, as in "
          "1432235498.028276.pcd; rename them, or give their poses as index-tum"));
    }
    const absl::StatusOr<TrajectoryPose> pose =
        file.trajectory.At(absl::ToDoubleSeconds(*scan.time - absl::UnixEpoch()));
    scan.pose_status = Annotate(pose.status(), trajectory.string());
    if (pose.ok()) scan.T_map_scan = pose->T_map_body * T_body_scan;
  }
  return absl::OkStatus();
}

}  // namespace strata
