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
#include "core/geometry/skew.h"

namespace strata {

namespace {

// How a right-hand step of T_map_body T_body_scan follows from one of T_map_body.
Matrix6d StepOfMounted(const Pose& T_body_scan) {
  const Eigen::Matrix3d R_scan_body = T_body_scan.linear().transpose();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = R_scan_body;
  J.bottomLeftCorner<3, 3>() = -R_scan_body * Skew(T_body_scan.translation());
  J.bottomRightCorner<3, 3>() = R_scan_body;
  return J;
}

}  // namespace

bool IsTrajectory(const std::filesystem::path& path) {
  return HasColumns(CsvHeader(path), {"time", "x", "y", "z", "qx", "qy", "qz", "qw", "c00", "c55"});
}

absl::Status TimeByName(std::vector<ScanFile>& scans) {
  for (ScanFile& scan : scans) {
    if (!scan.time.has_value()) scan.time = TimeOfName(scan.path);
    if (scan.time.has_value()) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(scan.path.string(),
                     ": a trajectory gives poses to scans whose names are times in seconds, as in "
                     "1432235498.028276.pcd; rename them, or give their poses as index-tum"));
  }
  return absl::OkStatus();
}

void PlaceOn(Trajectory trajectory,
             bool on_earth,
             const Pose& T_body_scan,
             std::vector<ScanFile>& scans) {
  const auto way = std::make_shared<const Trajectory>(std::move(trajectory));
  const Matrix6d by_body = StepOfMounted(T_body_scan);
  for (ScanFile& scan : scans) {
    const double stamp_s = absl::ToDoubleSeconds(*scan.time - absl::UnixEpoch());
    const absl::StatusOr<TrajectoryPose> pose = way->At(stamp_s);
    scan.pose_status = pose.status();
    if (!pose.ok()) continue;
    scan.T_map_scan = pose->T_map_body * T_body_scan;
    if (on_earth) scan.pose_covariance = by_body * pose->covariance * by_body.transpose();
    scan.pose_after = [way, T_body_scan, stamp_s](double offset_s) -> absl::StatusOr<Pose> {
      STRATA_ASSIGN_OR_RETURN(const TrajectoryPose after, way->At(stamp_s + offset_s));
      return after.T_map_body * T_body_scan;
    };
  }
}

absl::Status PlaceOnTrajectory(const std::filesystem::path& trajectory,
                               const Pose& T_body_scan,
                               std::vector<ScanFile>& scans) {
  STRATA_ASSIGN_OR_RETURN(TrajectoryFile file, ReadTrajectory(trajectory));
  STRATA_RETURN_IF_ERROR(TimeByName(scans));
  PlaceOn(std::move(file.trajectory), file.origin.has_value(), T_body_scan, scans);
  for (ScanFile& scan : scans) {
    scan.pose_status = Annotate(scan.pose_status, trajectory.string());
  }
  return absl::OkStatus();
}

}  // namespace strata
