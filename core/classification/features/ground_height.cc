#include "core/classification/features/ground_height.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/mls/build.h"
#include "core/mls/mls_map.h"

namespace strata {
namespace {

constexpr double kCellM = 0.5;
constexpr std::int32_t kReachCells = 6;
// Fewer measurements are no ground but stray returns from below it.
constexpr std::uint32_t kLeastCount = 2;

struct CellKey {
  CellIndex cell;
  template <typename H>
  friend H AbslHashValue(H h, const CellKey& key) {
    return H::combine(std::move(h), key.cell.x, key.cell.y);
  }
  friend bool operator==(const CellKey&, const CellKey&) = default;
};
using Heights = HashMap<CellKey, float>;

void Lower(Heights& heights, CellIndex cell, float z) {
  const auto [it, added] = heights.try_emplace(CellKey{cell}, z);
  if (!added) it->second = std::min(it->second, z);
}

Heights LowestPatches(const MlsMap& map) {
  Heights lowest;
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      if (patch.count < kLeastCount) continue;
      Lower(lowest, CellOf(tile.key, patch.cell), static_cast<float>(patch.bottom_m()));
    }
  }
  return lowest;
}

// The lowest within kReachCells along one axis of every cell.
Heights Spread(const Heights& heights, CellIndex step) {
  Heights spread;
  spread.reserve(2 * heights.size());
  for (const auto& [key, z] : heights) {
    for (std::int32_t k = -kReachCells; k <= kReachCells; ++k) {
      Lower(spread, {key.cell.x + k * step.x, key.cell.y + k * step.y}, z);
    }
  }
  return spread;
}

CellIndex CellAt(const Eigen::Vector3f& p) {
  return {static_cast<std::int32_t>(std::floor(static_cast<double>(p.x()) / kCellM)),
          static_cast<std::int32_t>(std::floor(static_cast<double>(p.y()) / kCellM))};
}

}  // namespace

absl::StatusOr<std::vector<float>> HeightsAboveLowest(std::span<const Eigen::Vector3f> points) {
  PointCloud cloud;
  cloud.points.assign(points.begin(), points.end());
  MlsParameters parameters;
  parameters.cell_size_m = kCellM;
  STRATA_ASSIGN_OR_RETURN(
      const MlsBuildResult built,
      BuildMlsMap(cloud,
                  Pose::Identity(),
                  {.sigma_m = 0.05, .sigma_per_metre = 0.0, .min_range_m = 0.0, .max_range_m = 1e6},
                  parameters));
  const Heights lowest = Spread(Spread(LowestPatches(built.map), {1, 0}), {0, 1});
  std::vector<float> heights(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto ground = lowest.find(CellKey{CellAt(points[i])});
    if (ground != lowest.end()) heights[i] = std::max(0.0F, points[i].z() - ground->second);
  }
  return heights;
}

}  // namespace strata
