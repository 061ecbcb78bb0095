#include "core/completion/square_voxels.h"

#include <algorithm>
#include <cmath>

namespace strata {
namespace {

constexpr double kFractions = 1 << 20;
constexpr double kMostVoxels = 2e9;

bool IsWithin(const Eigen::AlignedBox2d& square, const Eigen::Vector2d& p, double margin_m) {
  const Eigen::Array2d low = square.min().array() - margin_m;
  const Eigen::Array2d high = square.max().array() + margin_m;
  return (p.array() >= low).all() && (p.array() < high).all();
}

}  // namespace

void SquareVoxels::Add(std::span<const LabelledPoint> points, std::uint32_t scan) {
  for (const LabelledPoint& point : points) {
    if (point.label == 0) continue;
    const Eigen::Vector3d scaled = point.p / edge_m_;
    if (!(scaled.cwiseAbs().maxCoeff() < kMostVoxels)) continue;
    const Eigen::Vector3d corner = scaled.array().floor();
    const Eigen::Vector2d middle = edge_m_ * (corner.head<2>().array() + 0.5);
    if (!IsWithin(square_, middle, margin_m_)) continue;
    VoxelKey key{point.label, {}};
    for (int k = 0; k < 3; ++k) key.at[k] = static_cast<std::int32_t>(corner[k]);
    const auto [found, added] = index_.try_emplace(key, voxels_.size());
    if (added) voxels_.push_back({key, IsWithin(square_, middle, 0.0), 0, {}, {}});
    Voxel& voxel = voxels_[found->second];
    ++voxel.points;
    for (int k = 0; k < 3; ++k) {
      voxel.sum[k] += static_cast<std::int64_t>((scaled[k] - corner[k]) * kFractions);
    }
    if (voxel.seen.empty() || voxel.seen.back().scan != scan) voxel.seen.push_back({scan, 0});
    ++voxel.seen.back().points;
  }
}

Eigen::Vector3d SquareVoxels::MeanOf(const Voxel& voxel) const {
  Eigen::Vector3d mean;
  for (int k = 0; k < 3; ++k) {
    const double within = static_cast<double>(voxel.sum[k]) / kFractions / voxel.points;
    mean[k] = edge_m_ * (voxel.key.at[k] + within);
  }
  return mean;
}

std::map<std::uint16_t, std::vector<std::size_t>> SquareVoxels::ByClass() const {
  std::map<std::uint16_t, std::vector<std::size_t>> by_class;
  for (std::size_t i = 0; i < voxels_.size(); ++i) by_class[voxels_[i].key.class_id].push_back(i);
  return by_class;
}

}  // namespace strata
