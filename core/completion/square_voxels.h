// Labelled points of a square of the plan as voxels.
#ifndef STRATA_CORE_COMPLETION_SQUARE_VOXELS_H_
#define STRATA_CORE_COMPLETION_SQUARE_VOXELS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/hash_map.h"

namespace strata {

struct LabelledPoint {
  Eigen::Vector3d p;  // map frame [m]
  std::uint16_t label = 0;
};

// A cube of the map and a class: [k · edge, (k + 1) · edge) along each axis.
struct VoxelKey {
  std::uint16_t class_id = 0;
  std::array<std::int32_t, 3> at = {};

  friend bool operator==(const VoxelKey&, const VoxelKey&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const VoxelKey& key) {
    return H::combine(std::move(h), key.class_id, key.at[0], key.at[1], key.at[2]);
  }
};

// Whole voxels belong to one square, by their middles, whatever square's points are looked at: so
// squares agree about what each of them holds. The mean of a voxel's points is exact to its 2⁻²⁰
// in whatever order they come. One thread at a time.
class SquareVoxels {
 public:
  struct Seen {
    std::uint32_t scan = 0;
    std::uint32_t points = 0;
  };
  struct Voxel {
    VoxelKey key;
    bool own = false;  // of the square, not only near it
    std::uint32_t points = 0;
    std::array<std::int64_t, 3> sum = {};  // of the points' places in it, in 2⁻²⁰ of the edge
    std::vector<Seen> seen;
  };

  // Voxels whose middles are within `margin_m` of the square are there, too.
  SquareVoxels(const Eigen::AlignedBox2d& square, double edge_m, double margin_m)
      : square_(square), edge_m_(edge_m), margin_m_(margin_m) {}

  // The points of one scan, each scan once; labels 0 are left out, and places beyond ±2³¹ voxels.
  void Add(std::span<const LabelledPoint> points, std::uint32_t scan);

  // In the order in which they came.
  const std::vector<Voxel>& voxels() const { return voxels_; }
  // The mean of its points [m].
  Eigen::Vector3d MeanOf(const Voxel& voxel) const;
  const Eigen::AlignedBox2d& square() const { return square_; }
  // Indexes of the voxels of each class.
  std::map<std::uint16_t, std::vector<std::size_t>> ByClass() const;

 private:
  const Eigen::AlignedBox2d square_;
  const double edge_m_;
  const double margin_m_;
  std::vector<Voxel> voxels_;
  HashMap<VoxelKey, std::size_t> index_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_SQUARE_VOXELS_H_
