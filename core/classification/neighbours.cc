#include "core/classification/neighbours.h"

#include <algorithm>
#include <utility>

#include "core/classification/point_tree.h"

namespace strata {
Neighbours Neighbours::Find(std::span<const Eigen::Vector3f> points, std::size_t count) {
  Neighbours all;
  all.points_ = points.size();
  all.count_ = points.empty() ? 0 : std::min(count, points.size() - 1);
  all.Fill(points, points, true);
  return all;
}

Neighbours Neighbours::Find(std::span<const Eigen::Vector3f> queries,
                            std::span<const Eigen::Vector3f> points,
                            std::size_t count) {
  Neighbours all;
  all.points_ = queries.size();
  all.count_ = std::min(count, points.size());
  all.Fill(queries, points, false);
  return all;
}

void Neighbours::Fill(std::span<const Eigen::Vector3f> queries,
                      std::span<const Eigen::Vector3f> points,
                      bool without_self) {
  if (count_ == 0) return;
  indices_.resize(points_ * count_);
  squared_.resize(points_ * count_);
  const PointsView view{points};
  const PointTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  const std::size_t found = count_ + (without_self ? 1 : 0);
  std::vector<std::uint32_t> indices(found);
  std::vector<float> squared(found);
  std::vector<std::pair<float, std::uint32_t>> order(found);
  for (std::size_t p = 0; p < queries.size(); ++p) {
    tree.knnSearch(queries[p].data(), found, indices.data(), squared.data());
    for (std::size_t k = 0; k < found; ++k) {
      const bool self = without_self && indices[k] == p;
      order[k] = {self ? -1.0F : squared[k], indices[k]};
    }
    std::sort(order.begin(), order.end());
    // Where many points are at one place, the point itself may not be among the nearest.
    const std::size_t skip = order.front().first < 0.0F ? 1 : 0;
    for (std::size_t k = 0; k < count_; ++k) {
      squared_[p * count_ + k] = order[k + skip].first;
      indices_[p * count_ + k] = order[k + skip].second;
    }
  }
}

}  // namespace strata
