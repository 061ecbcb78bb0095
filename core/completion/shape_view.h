// A thing as scans saw it, in the frame of its kind: what they measured of it, and what they say
// of the space around it.
#ifndef STRATA_CORE_COMPLETION_SHAPE_VIEW_H_
#define STRATA_CORE_COMPLETION_SHAPE_VIEW_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"
#include "core/occupancy/occupancy_voxels.h"

namespace strata {

// Of a box that is looked at; memory and time grow with it.
inline constexpr double kMostShapeVoxels = 4'000'000.0;

enum class ShapeSight : std::uint8_t {
  kHidden,  // nobody looked there
  kThing,   // the thing was measured there
  kOther,   // something else was
  kEmpty,   // rays went through
};

// Voxel n is [n, n + 1) · voxel_m along each axis. Not thread-safe, reading neither.
class ShapeView {
 public:
  struct Voxel {
    Eigen::Vector3i at;
    Eigen::Vector3d mean;  // of the thing's points in it, frame of the kind [m]
  };

  // What is looked at: `box`, in the frame of the kind. INVALID_ARGUMENT for an edge outside
  // [0.005, 1] m, a box that is empty or not finite, or one of more than kMostShapeVoxels.
  static absl::StatusOr<ShapeView> Over(const Eigen::AlignedBox3d& box, double voxel_m);

  // Points of the thing, in the frame of the kind [m]; those outside the box are left out.
  void AddPoints(std::span<const Eigen::Vector3d> points);
  // What the rays of a whole scan ended at and went through; as OccupancyVoxels::Add().
  absl::Status AddScan(const PointCloud& cloud,
                       const Pose& T_kind_scan,
                       const SensorModel& sensor,
                       const Stop& stop);

  double voxel_m() const { return grid_.voxel_m(); }
  const Eigen::AlignedBox3d& box() const { return box_; }
  // The thing's, by z, y and x.
  std::vector<Voxel> Voxels() const;
  ShapeSight At(const Eigen::Vector3i& voxel) const;
  // Whether the thing was measured in it or next to it: poses err by some centimetres.
  bool IsNear(const Eigen::Vector3i& voxel) const;
  // Whether rays went through two thirds of the 26 around it: between them it was only missed.
  bool IsAmidEmpty(const Eigen::Vector3i& voxel) const;
  // Whether a ray may have gone by as near as a beam is wide, in frame of the kind [m].
  bool IsBesideEmpty(const Eigen::Vector3d& p) const;

 private:
  struct Sum {
    Eigen::Vector3f offset = Eigen::Vector3f::Zero();  // from the voxel's corner [voxels]
    std::uint32_t points = 0;
  };

  ShapeView(const Eigen::AlignedBox3d& box, const OccupancyVoxelsOptions& options)
      : box_(box), grid_(options) {}
  bool IsThing(const Eigen::Vector3i& voxel) const;

  Eigen::AlignedBox3d box_;
  OccupancyVoxels grid_;
  VoxelBlocks<Sum> thing_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_SHAPE_VIEW_H_
