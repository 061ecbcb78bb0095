#include "client/formats/bags/laser_sweeps.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/formats/bags/ros_messages.h"
#include "core/cloud/deskew.h"
#include "core/common/status.h"

namespace strata {
namespace {

// A line in the frame that the laser was in at its stamp, and T_map_line then.
struct PosedLine {
  PointCloud line;
  Pose T_map_line = Pose::Identity();
};

absl::StatusOr<PosedLine> PoseLine(RosLaserScan scan,
                                   std::uint32_t frame,
                                   const LinePoses& line_poses) {
  const auto pose_at = [&](double offset_s) {
    return line_poses(frame, scan.header.stamp_ns + std::llround(1e9 * offset_s));
  };
  PosedLine posed;
  STRATA_ASSIGN_OR_RETURN(posed.T_map_line, pose_at(0.0));
  if (scan.line.time.size() < 2) {
    posed.line = std::move(scan.line);
    posed.line.time.clear();
    return posed;
  }
  const double stamp_s = 1e-9 * static_cast<double>(scan.header.stamp_ns);
  STRATA_ASSIGN_OR_RETURN(posed.line, Deskew(std::move(scan.line), stamp_s, pose_at));
  return posed;
}

void Append(const PosedLine& posed, const Pose& T_scan_map, PointCloud& sweep) {
  const Pose T_scan_line = T_scan_map * posed.T_map_line;
  for (const Eigen::Vector3f& p : posed.line.points) {
    sweep.points.push_back((T_scan_line * p.cast<double>()).cast<float>());
  }
  sweep.intensity.insert(
      sweep.intensity.end(), posed.line.intensity.begin(), posed.line.intensity.end());
}

}  // namespace

std::vector<LaserSweep> SweepsOf(const std::vector<RecordedCloud>& lines, double sweep_s) {
  std::vector<LaserSweep> sweeps;
  const double sweep_ns = 1e9 * sweep_s;
  for (const RecordedCloud& line : lines) {
    const auto since_ns = static_cast<double>(line.stamp_ns - lines.front().stamp_ns);
    const auto number = static_cast<std::uint64_t>(since_ns / sweep_ns);
    if (sweeps.empty() || sweeps.back().number != number) {
      sweeps.emplace_back().number = number;
    }
    sweeps.back().lines.push_back(line);
  }
  if (sweeps.size() < 2) return sweeps;
  // Where its border falls between two stamps a whole sweep has a line less than the one before.
  const std::size_t whole = sweeps[sweeps.size() - 2].lines.size();
  if (sweeps.back().lines.size() + 1 < whole) sweeps.pop_back();
  return sweeps;
}

absl::StatusOr<PointCloud> ReadSweep(Recording& recording,
                                     const LaserSweep& sweep,
                                     MessageEncoding encoding,
                                     const Pose& T_map_scan,
                                     const LinePoses& line_poses) {
  PointCloud cloud;
  const Pose T_scan_map = T_map_scan.inverse();
  Eigen::Vector3d sensor_sum = Eigen::Vector3d::Zero();
  std::size_t posed_lines = 0;
  absl::Status first_fault;
  for (const RecordedCloud& line : sweep.lines) {
    STRATA_ASSIGN_OR_RETURN(const std::string message, recording.Read(line));
    STRATA_ASSIGN_OR_RETURN(RosLaserScan scan, ReadRosLaserScan(message, encoding));
    const absl::StatusOr<PosedLine> posed = PoseLine(std::move(scan), line.frame, line_poses);
    if (!posed.ok()) {
      if (first_fault.ok()) first_fault = posed.status();
      continue;
    }
    Append(*posed, T_scan_map, cloud);
    sensor_sum += T_scan_map * posed->T_map_line.translation();
    ++posed_lines;
  }
  if (posed_lines == 0) return first_fault;
  cloud.sensor_origin = (sensor_sum / static_cast<double>(posed_lines)).cast<float>();
  if (cloud.intensity.size() != cloud.points.size()) cloud.intensity.clear();
  STRATA_RETURN_IF_ERROR(ValidateCloud(cloud));
  return cloud;
}

}  // namespace strata
