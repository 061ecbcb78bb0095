// What the rays of scans hit and what they went through, voxel by voxel.
#ifndef STRATA_CORE_MESH_OCCUPANCY_VOXELS_H_
#define STRATA_CORE_MESH_OCCUPANCY_VOXELS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {

enum class Occupancy : std::uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2 };

// Those of a block, as NodeInBlock counts; voxel n is [n, n + 1) · voxel_m along each axis.
using OccupancyBlock = std::array<Occupancy, kBlockNodes>;

// Voxels lie in [-kMaxVoxel, kMaxVoxel) along each axis, as OctoMap's do.
inline constexpr int kMaxVoxel = 1 << 15;

struct OccupancyVoxelsOptions {
  double voxel_m = 0.1;  // in [0.001, 1000]
  // Only voxels whose middles lie in it, of rays that end outside, too [m].
  Eigen::AlignedBox3d region = {Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};

  absl::Status Validate() const;
};

// Occupancy as log-odds (thesis 6.2.1; Hornung et al., "OctoMap", 2013, with its probabilities:
// 0.7 for a hit, 0.4 for a miss, kept in [0.12, 0.97]). A scan hits the voxels of its points and
// misses those between sensor and points that it does not hit, each once; one ray a voxel is cast.
// Not thread-safe.
class OccupancyVoxels {
 public:
  // REQUIRES: valid options.
  explicit OccupancyVoxels(const OccupancyVoxelsOptions& options);

  // Points that are not finite or that the sensor would not take are left out. OUT_OF_RANGE for
  // what lies beyond kMaxVoxel, RESOURCE_EXHAUSTED beyond 2 GB, CANCELLED, DEADLINE_EXCEEDED; the
  // grid is to be thrown away then.
  absl::Status Add(const PointCloud& cloud,
                   const Pose& T_map_scan,
                   const SensorModel& sensor,
                   const Stop& stop);

  double voxel_m() const { return voxel_m_; }
  // Blocks with anything in them, in the order in which they were made.
  const std::vector<BlockKey>& keys() const { return voxels_.keys(); }
  OccupancyBlock block(std::size_t i) const;

 private:
  struct Voxel {
    std::int16_t odds = 0;
    std::uint16_t seen = 0;  // 2 · scan, and 1 more if that hit it; 1: by an earlier one; 0: never
  };
  struct Ray {
    Eigen::Vector3d from, to;  // [voxels]
    bool ends = true;          // at what was hit, not at the edge of the region
  };

  void BeginScan();
  absl::Status Check(const Stop& stop) const;
  bool Inside(const Eigen::Vector3i& at) const {
    return (at.array() >= low_.array()).all() && (at.array() < high_.array()).all();
  }
  Voxel& At(const Eigen::Vector3i& at) { return voxels_.FindOrAdd(BlockOf(at))[NodeInBlock(at)]; }
  bool Hit(const Eigen::Vector3i& at);
  void Miss(const Eigen::Vector3i& at);
  bool Clip(Ray& ray) const;
  void Cast(const Ray& ray);

  double voxel_m_;
  Eigen::Vector3i low_, high_;  // voxels that are kept
  VoxelBlocks<Voxel> voxels_;
  std::uint16_t scan_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_MESH_OCCUPANCY_VOXELS_H_
