// Occupied and free space as an octree of OctoMap.
#ifndef STRATA_CLIENT_FORMATS_GRID_OCTREE_WRITER_H_
#define STRATA_CLIENT_FORMATS_GRID_OCTREE_WRITER_H_

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"

namespace strata {

// Nodes that an octree may have.
inline constexpr std::size_t kMaxOctreeNodes = 50'000'000;

// Scans become an octree one after the other (Hornung et al. 2013): of each, the voxels of its
// points are hit, and those between sensor and points that are not are missed, all once; how often
// counts. One ray a voxel is cast. Not thread-safe.
class OctreeWriter {
 public:
  // Voxels have an edge of `voxel_m` > 0. Only voxels whose middles lie in the region are
  // kept, of rays that end outside too.
  OctreeWriter(double voxel_m, const std::optional<Eigen::AlignedBox3d>& region);
  ~OctreeWriter();

  // Points that are not finite or that the sensor would not take are left out. OUT_OF_RANGE for
  // places beyond 32,767 voxels from 0, RESOURCE_EXHAUSTED beyond kMaxOctreeNodes, CANCELLED,
  // DEADLINE_EXCEEDED; the octree is to be thrown away then.
  absl::Status Add(const PointCloud& cloud,
                   const Pose& T_map_scan,
                   const SensorModel& sensor,
                   const Stop& stop);

  // Volumes [m³].
  struct Extent {
    std::size_t nodes = 0;
    double occupied_m3 = 0.0;
    double free_m3 = 0.0;
  };
  // Every voxel becomes what is likelier, equal ones are put together: nothing can be added then.
  Extent Finish();
  // A .bt file: what is neither occupied nor free is not in it. INTERNAL if OctoMap fails.
  // REQUIRES: Finish().
  absl::StatusOr<std::string> BtBytes() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GRID_OCTREE_WRITER_H_
