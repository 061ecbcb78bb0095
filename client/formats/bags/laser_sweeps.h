// Scans out of the lines of a laser that a joint turns or tilts.
#ifndef STRATA_CLIENT_FORMATS_BAGS_LASER_SWEEPS_H_
#define STRATA_CLIENT_FORMATS_BAGS_LASER_SWEEPS_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/bags/recording.h"
#include "client/formats/bags/ros_topic.h"
#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

// Consecutive lines that make a scan.
struct LaserSweep {
  std::uint64_t number = 0;  // of those since the first line
  std::vector<RecordedCloud> lines;
  // That of the line in the middle: where the robot was then, the scan is.
  std::int64_t stamp_ns() const { return lines[lines.size() / 2].stamp_ns; }
};

// The lines by `sweep_s` from the first one on; what is not the whole of a sweep at the end is left
// out, unless there is nothing else. REQUIRES: the lines are in the order of their stamps, and
// sweep_s > 0.
std::vector<LaserSweep> SweepsOf(const std::vector<RecordedCloud>& lines, double sweep_s);

// T_map_line of a line in a frame (its number in the topic) at a time.
using LinePoses = std::function<absl::StatusOr<Pose>(std::uint32_t frame, std::int64_t stamp_ns)>;

// The points of all lines, each from where the laser was at its time (thesis 4.2): with the robot
// that moved and the joints that turned meanwhile. In the frame that is at T_map_scan; the sensor's
// origin is where the laser was on average. Lines without a pose are left out; NOT_FOUND if none
// has one. DATA_LOSS, INVALID_ARGUMENT if a line cannot be read.
absl::StatusOr<PointCloud> ReadSweep(Recording& recording,
                                     const LaserSweep& sweep,
                                     MessageEncoding encoding,
                                     const Pose& T_map_scan,
                                     const LinePoses& line_poses);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_LASER_SWEEPS_H_
