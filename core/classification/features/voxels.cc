#include "core/classification/features/voxels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace strata {
namespace {

constexpr int kBits = 21;
constexpr double kHalf = 1 << (kBits - 1);

std::uint64_t VoxelOf(const Eigen::Vector3f& p, double edge_m) {
  std::uint64_t key = 0;
  for (const float x : p) {
    const double at = std::clamp(std::floor(static_cast<double>(x) / edge_m), -kHalf, kHalf - 1.0);
    key = key << kBits | static_cast<std::uint64_t>(at + kHalf);
  }
  return key;
}

}  // namespace

std::vector<Eigen::Vector3f> VoxelMeans(std::span<const Eigen::Vector3f> points, double edge_m) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    order[i] = {VoxelOf(points[i], edge_m), static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  std::vector<Eigen::Vector3f> means;
  for (std::size_t begin = 0; begin < order.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t end = begin;
    for (; end < order.size() && order[end].first == order[begin].first; ++end) {
      sum += points[order[end].second].cast<double>();
    }
    means.emplace_back((sum / static_cast<double>(end - begin)).cast<float>());
    begin = end;
  }
  return means;
}

}  // namespace strata
