#include "client/ros2/messages.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Geometry>
#include <ros_messages.h>

#include "core/mls/tile_key.h"

namespace strata::ros2 {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::uint8_t kFloat32 = 7;  // of sensor_msgs/PointField
constexpr std::uint8_t kUint8 = 2;

// Valid as long as what it is made of. Messages are only read; C knows no const here.
char* Chars(const std::string& text) { return const_cast<char*>(text.c_str()); }

builtin_interfaces_msg_dds__Time_ TimeOf(std::int64_t stamp_ns) {
  return {static_cast<std::int32_t>(stamp_ns / kNsPerSecond),
          static_cast<std::uint32_t>(stamp_ns % kNsPerSecond)};
}

std_msgs_msg_dds__Header_ HeaderOf(const OutHeader& header) {
  return {TimeOf(header.stamp_ns), Chars(header.frame)};
}

geometry_msgs_msg_dds__Pose_ PoseOf(const Pose& T) {
  const Eigen::Vector3d p = T.translation();
  const Eigen::Quaterniond q(T.rotation());
  return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

geometry_msgs_msg_dds__Quaternion_ TurnTo(const Eigen::Vector3d& way) {
  const double half = 0.5 * std::atan2(way.y(), way.x());
  return {0.0, 0.0, std::sin(half), std::cos(half)};
}

Colour ColourOf(const Surface& surface) {
  if (surface.coloured()) return surface.colour;
  switch (surface.traversability) {
    case Traversability::kTraversable:
      return {.r = 60, .g = 170, .b = 80};
    case Traversability::kNonTraversable:
      return {.r = 200, .g = 60, .b = 50};
    case Traversability::kUnknown:
    case Traversability::kUnderside:
      break;
  }
  return {.r = 130, .g = 130, .b = 130};
}

}  // namespace

std::vector<std::int8_t> OccupancyOf(const OccupancyGrid& grid) {
  std::vector<std::int8_t> values;
  values.reserve(grid.cells.size());
  for (const GridCell cell : grid.cells) {
    values.push_back(cell == GridCell::kFree ? 0 : cell == GridCell::kOccupied ? 100 : -1);
  }
  return values;
}

std::string SurfaceBytes(const std::vector<SurfaceTile>& tiles, double cell_size_m) {
  std::size_t count = 0;
  for (const SurfaceTile& tile : tiles) count += tile.surfaces.size();
  std::string bytes;
  bytes.reserve(count * kSurfaceBytes);
  for (const SurfaceTile& tile : tiles) {
    for (const Surface& surface : tile.surfaces) {
      const CellIndex cell = CellOf(tile.key, surface.cell);
      const float place[3] = {static_cast<float>((cell.x + 0.5) * cell_size_m),
                              static_cast<float>((cell.y + 0.5) * cell_size_m),
                              surface.z_m};
      const std::uint32_t rgb = PackedRgb(ColourOf(surface));
      char point[kSurfaceBytes] = {};
      std::memcpy(point, place, sizeof(place));
      std::memcpy(point + 12, &rgb, sizeof(rgb));
      point[16] = static_cast<char>(surface.class_id);
      point[17] = static_cast<char>(surface.traversability);
      bytes.append(point, sizeof(point));
    }
  }
  return bytes;
}

// A right-hand step δ on T_map_scan is one of Ad(T_base_scan) δ on T_map_base.
Matrix6d RosCovariance(const Pose& T_map_scan,
                       const Matrix6d& covariance,
                       const Pose& T_base_scan) {
  const Eigen::Matrix3d R_map_scan = T_map_scan.rotation();
  const Eigen::Matrix3d R_map_base = R_map_scan * T_base_scan.rotation().transpose();
  const Eigen::Vector3d lever = R_map_base * T_base_scan.translation();
  Eigen::Matrix3d across;  // v -> lever × v
  across << 0.0, -lever.z(), lever.y(), lever.z(), 0.0, -lever.x(), -lever.y(), lever.x(), 0.0;
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = across * R_map_scan;
  J.topRightCorner<3, 3>() = R_map_scan;
  J.bottomLeftCorner<3, 3>() = R_map_scan;
  return J * covariance * J.transpose();
}

absl::Status WriteGrid(const Entity& writer,
                       const OutHeader& header,
                       const OccupancyGrid& grid,
                       double z_m) {
  std::vector<std::int8_t> values = OccupancyOf(grid);
  nav_msgs_msg_dds__OccupancyGrid_ message{};
  message.header = HeaderOf(header);
  message.info.map_load_time = message.header.stamp;
  message.info.resolution = static_cast<float>(grid.resolution_m);
  message.info.width = static_cast<std::uint32_t>(grid.width);
  message.info.height = static_cast<std::uint32_t>(grid.height);
  message.info.origin = {{grid.x_m, grid.y_m, z_m}, {0.0, 0.0, 0.0, 1.0}};
  message.data._buffer = values.data();
  message.data._length = message.data._maximum = static_cast<std::uint32_t>(values.size());
  return Node::Write(writer, &message);
}

absl::Status WritePath(const Entity& writer,
                       const OutHeader& header,
                       const std::vector<Eigen::Vector3d>& waypoints) {
  std::vector<geometry_msgs_msg_dds__PoseStamped_> poses;
  geometry_msgs_msg_dds__Quaternion_ turn = {0.0, 0.0, 0.0, 1.0};
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Eigen::Vector3d& p = waypoints[i];
    if (i + 1 < waypoints.size())
      turn = TurnTo(waypoints[i + 1] - p);  // the last as the one before
    poses.push_back({HeaderOf(header), {{p.x(), p.y(), p.z()}, turn}});
  }
  nav_msgs_msg_dds__Path_ message{};
  message.header = HeaderOf(header);
  message.poses._buffer = poses.data();
  message.poses._length = message.poses._maximum = static_cast<std::uint32_t>(poses.size());
  return Node::Write(writer, &message);
}

absl::Status WriteSurfaces(const Entity& writer, const OutHeader& header, std::string& bytes) {
  std::array<std::string, 6> names = {"x", "y", "z", "rgb", "class", "traversability"};
  std::array<sensor_msgs_msg_dds__PointField_, 6> fields{};
  for (std::uint32_t i = 0; i < fields.size(); ++i) {
    const bool number = i < 4;
    fields[i] = {Chars(names[i]), number ? 4 * i : 12 + i, number ? kFloat32 : kUint8, 1};
  }
  sensor_msgs_msg_dds__PointCloud2_ message{};
  message.header = HeaderOf(header);
  message.height = 1;
  message.width = static_cast<std::uint32_t>(bytes.size() / kSurfaceBytes);
  message.fields._buffer = fields.data();
  message.fields._length = message.fields._maximum = static_cast<std::uint32_t>(fields.size());
  message.point_step = kSurfaceBytes;
  message.row_step = static_cast<std::uint32_t>(bytes.size());
  message.data._buffer = reinterpret_cast<std::uint8_t*>(bytes.data());
  message.data._length = message.data._maximum = message.row_step;
  message.is_dense = true;
  return Node::Write(writer, &message);
}

absl::Status WritePose(const Entity& writer,
                       const OutHeader& header,
                       const Pose& T_map_base,
                       const Matrix6d& covariance) {
  geometry_msgs_msg_dds__PoseWithCovarianceStamped_ message{};
  message.header = HeaderOf(header);
  message.pose.pose = PoseOf(T_map_base);
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(message.pose.covariance) = covariance;
  return Node::Write(writer, &message);
}

absl::Status WriteDiagnosis(const Entity& writer,
                            const OutHeader& header,
                            const Diagnosis& diagnosis) {
  std::vector<diagnostic_msgs_msg_dds__KeyValue_> values;
  for (const auto& [key, value] : diagnosis.values) values.push_back({Chars(key), Chars(value)});
  const std::string none;
  diagnostic_msgs_msg_dds__DiagnosticStatus_ status{};
  status.level = static_cast<std::uint8_t>(diagnosis.level);
  status.name = Chars(diagnosis.name);
  status.message = Chars(diagnosis.message);
  status.hardware_id = Chars(none);
  status.values._buffer = values.data();
  status.values._length = status.values._maximum = static_cast<std::uint32_t>(values.size());
  diagnostic_msgs_msg_dds__DiagnosticArray_ message{};
  message.header = HeaderOf(header);
  message.status._buffer = &status;
  message.status._length = message.status._maximum = 1;
  return Node::Write(writer, &message);
}

absl::Status WriteTransform(const Entity& writer,
                            const OutHeader& header,
                            const std::string& child,
                            const Pose& T_frame_child) {
  const Eigen::Vector3d p = T_frame_child.translation();
  const Eigen::Quaterniond q(T_frame_child.rotation());
  geometry_msgs_msg_dds__TransformStamped_ transform = {
      HeaderOf(header), Chars(child), {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}}};
  tf2_msgs_msg_dds__TFMessage_ message{};
  message.transforms._buffer = &transform;
  message.transforms._length = message.transforms._maximum = 1;
  return Node::Write(writer, &message);
}

}  // namespace strata::ros2
