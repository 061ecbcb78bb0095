// Fewer points, evenly over space, from scans that come one after the other.
#ifndef STRATA_CORE_MESH_POINT_THINNER_H_
#define STRATA_CORE_MESH_POINT_THINNER_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {

struct PointThinnerOptions {
  double edge_m = 0.05;  // of the cubes that keep one point; in [0.001, 10]
  // Only points in here count; in the map [m].
  Eigen::AlignedBox3d region{Eigen::Vector3d::Constant(-1e7), Eigen::Vector3d::Constant(1e7)};
  std::size_t max_points = 4'000'000;  // some 90 bytes each

  absl::Status Validate() const;
};

struct ThinnedPoints {
  std::vector<Eigen::Vector3d> points;  // in the map
  std::vector<Eigen::Vector3f>
      towards;  // from each to where it was seen from; a mean of unit vectors
};

// One thread at a time.
class PointThinner {
 public:
  // REQUIRES: options.Validate().
  explicit PointThinner(const PointThinnerOptions& options) : options_(options) {}

  // RESOURCE_EXHAUSTED beyond max_points; OUT_OF_RANGE for points farther than 10⁹ cubes from the
  // first; the stop's status. `cloud`: as ValidateCloud() takes it; `sensor`: whose returns count.
  absl::Status Add(const PointCloud& cloud,
                   const Pose& T_map_scan,
                   const SensorModel& sensor,
                   const Stop& stop);
  std::size_t size() const { return cubes_.size(); }
  // The centre of gravity of each cube's points, in the order of the cubes.
  ThinnedPoints Points() const;

 private:
  absl::Status TooMany() const;

  struct Cube {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();  // from its corner [cubes]
    std::uint32_t count = 0;
    Eigen::Vector3f towards = Eigen::Vector3f::Zero();
  };

  PointThinnerOptions options_;
  NodeGrid grid_;  // node n: the corner of cube n
  bool placed_ = false;
  HashMap<BlockKey, Cube> cubes_;
};

}  // namespace strata

#endif  // STRATA_CORE_MESH_POINT_THINNER_H_
