// Scans that get their poses from where the robot was when they were taken.
#ifndef STRATA_CLIENT_FORMATS_MOTION_PLACED_SCANS_H_
#define STRATA_CLIENT_FORMATS_MOTION_PLACED_SCANS_H_

#include <filesystem>
#include <vector>

#include "absl/status/status.h"

#include "client/formats/scan_list.h"
#include "core/geometry/pose.h"

namespace strata {

// Whether the file begins as TrajectoryText() writes it.
bool IsTrajectory(const std::filesystem::path& path);

// Gives each scan the time that its file's name is, in seconds since 1970 with a decimal point
// (1432235498.028276.pcd), as its pose the trajectory's at that time times `T_body_scan`, and the
// poses after it. Times that the trajectory does not hold are in the scan's `pose_status`. As
// ReadTrajectory(); INVALID_ARGUMENT naming the first file whose name is no time.
absl::Status PlaceOnTrajectory(const std::filesystem::path& trajectory,
                               const Pose& T_body_scan,
                               std::vector<ScanFile>& scans);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_MOTION_PLACED_SCANS_H_
