#include "core/mesh/point_thinner.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {

absl::Status PointThinnerOptions::Validate() const {
  OptionChecks checks("point thinner");
  checks.InRange("edge_m", edge_m, 0.001, 10.0);
  return checks.status();
}

absl::Status PointThinner::Add(const PointCloud& cloud,
                               const Pose& T_map_scan,
                               const SensorModel& sensor,
                               const Stop& stop) {
  if (!placed_) {
    grid_.spacing_m = options_.edge_m;
    grid_.origin = (T_map_scan * cloud.origin / options_.edge_m).array().round() * options_.edge_m;
    placed_ = true;
  }
  const Eigen::Matrix3f R = T_map_scan.linear().cast<float>();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % 4096 == 0) STRATA_RETURN_IF_ERROR(stop.status());
    const Eigen::Vector3f& p = cloud.points[i];
    if (!p.allFinite() || !sensor.Takes((p - cloud.sensor_origin).norm())) continue;
    const Eigen::Vector3d point = T_map_scan * (p.cast<double>() + cloud.origin);
    if (!options_.region.contains(point)) continue;
    const Eigen::Vector3d at = grid_.InNodes(point);
    if (!(at.cwiseAbs().maxCoeff() < kMostNodes)) {
      return absl::OutOfRangeError(absl::StrFormat(
          "a point lies more than 10⁹ cubes of %g m from the first scan: mesh a region of the map",
          options_.edge_m));
    }
    const Eigen::Vector3i node = at.array().floor().cast<int>();
    Cube& cube = cubes_[{node.x(), node.y(), node.z()}];
    cube.sum += (at - node.cast<double>()).cast<float>();
    cube.towards += R * (cloud.sensor_origin - p).normalized();
    ++cube.count;
    if (cubes_.size() > options_.max_points) return TooMany();
  }
  return absl::OkStatus();
}

absl::Status PointThinner::TooMany() const {
  return absl::ResourceExhaustedError(absl::StrFormat(
      "more than %d points %g m apart: mesh a smaller region, or with larger voxels",
      options_.max_points,
      options_.edge_m));
}

ThinnedPoints PointThinner::Points() const {
  std::vector<BlockKey> keys;
  keys.reserve(cubes_.size());
  for (const auto& [key, cube] : cubes_) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  ThinnedPoints thinned;
  thinned.points.reserve(keys.size());
  thinned.towards.reserve(keys.size());
  for (const BlockKey& key : keys) {
    const Cube& cube = cubes_.at(key);
    const Eigen::Vector3d mean = cube.sum.cast<double>() / cube.count;
    thinned.towards.push_back(cube.towards / static_cast<float>(cube.count));
    thinned.points.emplace_back(grid_.origin +
                                grid_.spacing_m * (Eigen::Vector3d(key.x, key.y, key.z) + mean));
  }
  return thinned;
}

}  // namespace strata
