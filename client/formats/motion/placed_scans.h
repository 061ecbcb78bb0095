// Scans that get their poses from where the robot was when they were taken.
#ifndef STRATA_CLIENT_FORMATS_MOTION_PLACED_SCANS_H_
#define STRATA_CLIENT_FORMATS_MOTION_PLACED_SCANS_H_

#include <filesystem>
#include <vector>

#include "absl/status/status.h"

#include "client/formats/scan_list.h"
#include "core/egomotion/trajectory.h"
#include "core/geometry/pose.h"

namespace strata {

// Whether the file begins as TrajectoryText() writes it.
bool IsTrajectory(const std::filesystem::path& path);

// Gives each scan that has no time the one that its file's name is, in seconds since 1970 with a
// decimal point (1432235498.028276.pcd). INVALID_ARGUMENT naming the first file whose name is no
// time.
absl::Status TimeByName(std::vector<ScanFile>& scans);

// Gives each scan as its pose the trajectory's at its time times `T_body_scan`, the poses after it
// and, `on_earth`, the covariance. Times that the trajectory does not hold are in the scan's
// `pose_status`. REQUIRES: scans have times.
void PlaceOn(Trajectory trajectory,
             bool on_earth,
             const Pose& T_body_scan,
             std::vector<ScanFile>& scans);

// Both, of a file of TrajectoryText(). As TimeByName() and ReadTrajectory().
absl::Status PlaceOnTrajectory(const std::filesystem::path& trajectory,
                               const Pose& T_body_scan,
                               std::vector<ScanFile>& scans);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_MOTION_PLACED_SCANS_H_
