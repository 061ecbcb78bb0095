// What the rays of scans hit and what they went through, voxel by voxel.
#ifndef STRATA_CORE_OCCUPANCY_OCCUPANCY_VOXELS_H_
#define STRATA_CORE_OCCUPANCY_OCCUPANCY_VOXELS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"
#include "core/occupancy/voxel_walk.h"

namespace strata {

enum class Occupancy : std::uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2 };

// Those of a block, as NodeInBlock counts; voxel n is [n, n + 1) · voxel_m along each axis.
using OccupancyBlock = std::array<Occupancy, kBlockNodes>;

// OctoMap's voxels lie in [-kMaxVoxel, kMaxVoxel) along each axis.
inline constexpr int kMaxVoxel = 1 << 15;

// What one scan says of a voxel that it hits or looks through (the inverse sensor model λ of thesis
// eq. 4.10), and what many say at most; probabilities that it is occupied. The defaults are
// OctoMap's (Hornung et al., 2013): what moves is forgotten after some scans.
struct InverseSensorModel {
  double hit = 0.7;       // in (0.5, most]
  double miss = 0.4;      // in [least, 0.5)
  double least = 0.1192;  // in [0.01, 0.5)
  double most = 0.971;    // in (0.5, 0.99]
  // A voxel that was hit stays hit, whatever looks through it, and it is kept at what heights: rays
  // that graze a floor go through its voxels for metres before they end.
  bool hits_stay = false;

  // One scan says as much as many, in any order: what tells seen from unseen where each place was
  // seen once.
  static constexpr InverseSensorModel OfOneLook() {
    InverseSensorModel model;
    model.hit = model.most;
    model.miss = model.least;
    model.hits_stay = true;
    return model;
  }
};

struct OccupancyVoxelsOptions {
  double voxel_m = 0.1;  // in [0.001, 1000]
  InverseSensorModel model = {};
  // Only voxels whose middles lie in it, of rays that end outside, too [m].
  Eigen::AlignedBox3d region = {Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};
  // No ray reaches it along an axis: as far as files of OctoMap reach; in [1, kMostNodes].
  double farthest_voxel = kMaxVoxel;

  absl::Status Validate() const;
};

// Occupancy as log-odds (thesis eq. 4.10 with l₀ = 0; Hornung et al., "OctoMap", 2013). A scan hits
// the voxels of its points and misses those between sensor and points that it does not hit, each
// once; one ray a voxel is cast. Not thread-safe.
class OccupancyVoxels {
 public:
  // REQUIRES: valid options.
  explicit OccupancyVoxels(const OccupancyVoxelsOptions& options);

  // Points that are not finite or nearer than the sensor sees are left out; of one that is farther
  // than it sees, the ray as far as it does: a beam that nothing came back from is a point beyond
  // the sensor's range. OUT_OF_RANGE for what lies beyond farthest_voxel, RESOURCE_EXHAUSTED beyond
  // 2 GB, CANCELLED, DEADLINE_EXCEEDED; the grid is to be thrown away then.
  absl::Status Add(const PointCloud& cloud,
                   const Pose& T_map_scan,
                   const SensorModel& sensor,
                   const Stop& stop);

  double voxel_m() const { return voxel_m_; }
  // Blocks with anything in them, in the order in which they were made.
  const std::vector<BlockKey>& keys() const { return voxels_.keys(); }
  OccupancyBlock block(std::size_t i) const;

  // Whether a voxel is one of those that are kept.
  bool Inside(const Eigen::Vector3i& at) const { return kept_.Contains(at); }
  // Log-odds are whole multiples of 1/kOddsPerNat; kUnknownOdds: nothing is known.
  static constexpr double kOddsPerNat = 27.15;  // hit and miss are then as 23 to 11
  static constexpr std::int16_t kUnknownOdds = std::numeric_limits<std::int16_t>::max();
  std::int16_t least_odds() const { return least_; }
  std::int16_t most_odds() const { return most_; }
  // What eq. 4.10 makes of known or unknown odds, or a hit that stays.
  std::int16_t After(std::int16_t odds, bool hit) const {
    const int before = odds == kUnknownOdds ? 0 : odds;
    if (hits_stay_ && before > 0) return odds;
    if (hits_stay_ && hit) return hit_;
    return static_cast<std::int16_t>(hit ? std::min(before + hit_, int{most_})
                                         : std::max(before + miss_, int{least_}));
  }
  static double ProbabilityOf(std::int16_t odds);
  // Voxels of which something is known, with their middles in `region`.
  std::size_t CountKnown(const Eigen::AlignedBox3d& region) const;
  std::size_t bytes() const { return voxels_.bytes() + heights_.bytes(); }

 private:
  friend class OccupancyReader;
  struct Voxel {
    std::int16_t odds = 0;
    std::uint16_t seen = 0;  // 2 · scan, and 1 more if that hit it; 1: by an earlier one; 0: never
  };
  // The heights in a voxel at which rays ended, in 255ths of its edge.
  struct Heights {
    std::uint8_t low = 255, high = 0;
    bool passed = false;  // by others

    void Add(double z) {
      const auto part = static_cast<std::uint8_t>(std::lround(255.0 * (z - std::floor(z))));
      low = std::min(low, part);
      high = std::max(high, part);
    }
  };
  struct Ray {
    Eigen::Vector3d from, to;  // [voxels]
    bool hits = true;          // something, not nothing as far as the sensor sees
    bool ends = true;          // at what was hit, not at the edge of the region
  };

  void BeginScan();
  absl::Status Check(const Stop& stop) const;
  Voxel& At(const Eigen::Vector3i& at) { return voxels_.FindOrAdd(BlockOf(at))[NodeInBlock(at)]; }
  bool Hit(const Eigen::Vector3i& at, double z);
  bool Miss(const Eigen::Vector3i& at);
  bool Clip(Ray& ray) const;
  void Cast(const Ray& ray);
  // In the region.
  Eigen::Vector3i Nearest(const Eigen::Vector3i& at) const {
    return at.cwiseMax(kept_.low).cwiseMin(kept_.high - Eigen::Vector3i::Ones());
  }

  double voxel_m_;
  double farthest_voxel_;
  std::int16_t hit_, miss_, least_, most_;
  bool hits_stay_;
  VoxelBox kept_;
  VoxelBlocks<Voxel> voxels_;
  VoxelBlocks<Heights> heights_;  // of what was hit, where hits stay
  std::uint16_t scan_ = 0;
};

// Looks voxels up in a grid that nobody changes; a thread has one of its own.
class OccupancyReader {
 public:
  // `grid` must outlive it.
  explicit OccupancyReader(const OccupancyVoxels& grid) : grid_(grid) {}

  // OccupancyVoxels::kUnknownOdds where nothing is known.
  std::int16_t Odds(const Eigen::Vector3i& at) {
    const BlockKey key = BlockOf(at);
    if (!has_last_ || key != last_key_) {
      last_ = grid_.voxels_.Peek(key);
      last_key_ = key;
      has_last_ = true;
    }
    if (last_ == nullptr) return OccupancyVoxels::kUnknownOdds;
    const OccupancyVoxels::Voxel& voxel = (*last_)[NodeInBlock(at)];
    return voxel.seen == 0 ? OccupancyVoxels::kUnknownOdds : voxel.odds;
  }
  double Probability(const Eigen::Vector3i& at) { return OccupancyVoxels::ProbabilityOf(Odds(at)); }
  // Whether a voxel that is occupied lets a beam pass that is between two heights there [voxels]:
  // others passed it, and all that ended there did so at about one height, and not at such a one.
  bool Passes(const Eigen::Vector3i& at, double z_in, double z_out) const {
    const auto* block = grid_.heights_.Peek(BlockOf(at));
    if (block == nullptr) return false;
    const OccupancyVoxels::Heights& heights = (*block)[NodeInBlock(at)];
    if (!heights.passed || heights.high - heights.low > kMostFloorHeights) return false;
    const double low = at.z() + (heights.low - 1) / 255.0;
    const double high = at.z() + (heights.high + 1) / 255.0;
    return std::max(z_in, z_out) < low || std::min(z_in, z_out) > high;
  }

 private:
  // A slope of 0.35 and some noise; walls have more [255ths of a voxel].
  static constexpr int kMostFloorHeights = 100;

  const OccupancyVoxels& grid_;
  const VoxelBlocks<OccupancyVoxels::Voxel>::Block* last_ = nullptr;
  BlockKey last_key_;
  bool has_last_ = false;
};

}  // namespace strata

#endif  // STRATA_CORE_OCCUPANCY_OCCUPANCY_VOXELS_H_
