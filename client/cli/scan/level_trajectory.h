// Turns a trajectory so that the dominant floor of its first scans is level.
#ifndef STRATA_CLIENT_CLI_SCAN_LEVEL_TRAJECTORY_H_
#define STRATA_CLIENT_CLI_SCAN_LEVEL_TRAJECTORY_H_

#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/scan_list.h"

namespace strata::cli {

// Applies one rotation about the first scan to all poses: the smallest that makes the dominant
// floor of the first five scans level. A pure function of these files and poses, so that importing
// the rest of a folder later turns it the same way. Returns the angle [rad].
// FAILED_PRECONDITION if no floor is found.
absl::StatusOr<double> LevelTrajectory(std::vector<ScanFile>& scans);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_LEVEL_TRAJECTORY_H_
