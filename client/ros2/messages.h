// What is known of a map, as messages of ROS 2.
#ifndef STRATA_CLIENT_ROS2_MESSAGES_H_
#define STRATA_CLIENT_ROS2_MESSAGES_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "client/formats/grid_writer.h"
#include "client/ros2/node.h"
#include "core/geometry/pose.h"
#include "core/mls/surface_tile.h"

namespace strata::ros2 {

// std_msgs/Header.
struct OutHeader {
  std::string frame;
  std::int64_t stamp_ns = 0;
};

// The values of nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown, and ground on which the
// robot cannot stand, as map export --format nav2 has it.
std::vector<std::int8_t> OccupancyOf(const OccupancyGrid& grid);

// A surface in sensor_msgs/PointCloud2, 20 bytes: x, y, z and rgb as floats; class (0: none) and
// traversability as bytes. Its own colour, or that of what it is for the robot: green, red, grey.
inline constexpr std::uint32_t kSurfaceBytes = 20;
std::string SurfaceBytes(const std::vector<SurfaceTile>& tiles, double cell_size_m);

// The covariance of geometry_msgs/PoseWithCovariance: of the base's position and of a turn about
// the map's axes, out of that of a right-hand step on T_map_scan.
Matrix6d RosCovariance(const Pose& T_map_scan, const Matrix6d& covariance, const Pose& T_base_scan);

// diagnostic_msgs/DiagnosticStatus.
struct Diagnosis {
  enum class Level : std::uint8_t { kOk, kWarn, kError };
  Level level = Level::kOk;
  std::string name, message;
  std::vector<std::pair<std::string, std::string>> values = {};
};

// nav_msgs/OccupancyGrid, drawn at the height `z_m`.
absl::Status WriteGrid(const Entity& writer,
                       const OutHeader& header,
                       const OccupancyGrid& grid,
                       double z_m);
// nav_msgs/Path: each pose faces the next. Empty where there is no way.
absl::Status WritePath(const Entity& writer,
                       const OutHeader& header,
                       const std::vector<Eigen::Vector3d>& waypoints);
// sensor_msgs/PointCloud2 of SurfaceBytes.
absl::Status WriteSurfaces(const Entity& writer, const OutHeader& header, std::string& bytes);
// geometry_msgs/PoseWithCovarianceStamped, `covariance` as of RosCovariance.
absl::Status WritePose(const Entity& writer,
                       const OutHeader& header,
                       const Pose& T_map_base,
                       const Matrix6d& covariance);
// diagnostic_msgs/DiagnosticArray of one.
absl::Status WriteDiagnosis(const Entity& writer,
                            const OutHeader& header,
                            const Diagnosis& diagnosis);
// tf2_msgs/TFMessage with T_frame_child.
absl::Status WriteTransform(const Entity& writer,
                            const OutHeader& header,
                            const std::string& child,
                            const Pose& T_frame_child);

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_MESSAGES_H_
