#include "client/cli/scan/level_trajectory.h"

#include <algorithm>
#include <vector>

#include <Eigen/Geometry>

#include "client/formats/scan_reader.h"
#include "core/common/status.h"
#include "core/geometry/rotation_between.h"
#include "core/registration/clouds/leveling.h"

namespace strata::cli {
namespace {

// Scans whose floors are averaged: more steady the normal, each costs reading a file.
constexpr int kScans = 5;

// The floor's upward normal in the map, times its share of the scan's points.
absl::StatusOr<Eigen::Vector3d> WeightedNormal(const ScanFile& scan) {
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScanFile(scan));
  // In the axes of the map, so that a tilted mount that the pose knows of does not count as tilt.
  const Eigen::Matrix3f R_map_scan = scan.T_map_scan.linear().cast<float>();
  for (Eigen::Vector3f& p : cloud.points) {
    p = R_map_scan * p;
  }
  STRATA_ASSIGN_OR_RETURN(const Leveling leveling, LevelByFloor(cloud));
  return leveling.support * leveling.R_level_scan.transpose() * Eigen::Vector3d::UnitZ();
}

}  // namespace

absl::StatusOr<double> LevelTrajectory(std::vector<ScanFile>& scans) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  int used = 0;
  absl::Status last = absl::NotFoundError("no scan with a pose");
  for (const ScanFile& scan : scans) {
    if (used == kScans || !scan.pose_status.ok()) {
      continue;
    }
    ++used;
    const absl::StatusOr<Eigen::Vector3d> one = WeightedNormal(scan);
    if (one.ok()) {
      normal += *one;
    } else {
      last = one.status();
    }
  }
  if (normal.isZero()) {
    return Annotate(absl::FailedPreconditionError(last.message()), "no floor to level by");
  }
  const Eigen::Quaterniond R_level_map = RotationBetween(normal, Eigen::Vector3d::UnitZ());
  // About the first scan, so that a map far from its origin stays in place.
  const Eigen::Vector3d centre = scans.front().T_map_scan.translation();
  const Pose T_level_map = MakePose(R_level_map, centre - R_level_map * centre);
  for (ScanFile& scan : scans) {
    scan.T_map_scan = Normalized(T_level_map * scan.T_map_scan);
  }
  return RotationAngleRad(T_level_map);
}

}  // namespace strata::cli
