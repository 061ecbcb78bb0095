// Trajectories with covariance as CSV.
#ifndef STRATA_CLIENT_FORMATS_MOTION_TRAJECTORY_FILE_H_
#define STRATA_CLIENT_FORMATS_MOTION_TRAJECTORY_FILE_H_

#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"

#include "core/egomotion/trajectory.h"
#include "core/world/map_info.h"

namespace strata {

struct TrajectoryFile {
  Trajectory trajectory;
  std::optional<GeodeticOrigin> origin;  // where its map is on earth: x east, y north
};

// A comment line "# origin LATITUDE LONGITUDE ALTITUDE" (degrees, m) if there is one, the line of
// names, then a line a pose: time (seconds since 1970, 6 decimals), x y z (m), qx qy qz qw with qw
// ≥ 0, and the 36 entries of the covariance of a right-hand step [rotation, translation] (rad, m),
// row by row: c00 … c55.
std::string TrajectoryText(const TrajectoryFile& file);

// What TrajectoryText() writes; columns in any order, others may be there. NOT_FOUND;
// INVALID_ARGUMENT naming file, line and what was expected, and as Trajectory::Make().
absl::StatusOr<TrajectoryFile> ReadTrajectory(const std::filesystem::path& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_MOTION_TRAJECTORY_FILE_H_
