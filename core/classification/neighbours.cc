#include "core/classification/neighbours.h"

#include <algorithm>
#include <utility>

#include <nanoflann.hpp>

namespace strata {
namespace {

// nanoflann's view of the points; its method names are given.
struct PointsView {
  std::span<const Eigen::Vector3f> points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t k) const {
    return points[i][static_cast<Eigen::Index>(k)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointsView>,
                                                 PointsView,
                                                 3,
                                                 std::uint32_t>;

}  // namespace

Neighbours Neighbours::Find(std::span<const Eigen::Vector3f> points, std::size_t count) {
  Neighbours all;
  all.points_ = points.size();
  all.count_ = points.empty() ? 0 : std::min(count, points.size() - 1);
  if (all.count_ == 0) return all;
  all.indices_.resize(all.points_ * all.count_);
  all.squared_.resize(all.points_ * all.count_);
  const PointsView view{points};
  const Tree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  const std::size_t found = all.count_ + 1;  // itself too
  std::vector<std::uint32_t> indices(found);
  std::vector<float> squared(found);
  std::vector<std::pair<float, std::uint32_t>> order(found);
  for (std::size_t p = 0; p < points.size(); ++p) {
    tree.knnSearch(points[p].data(), found, indices.data(), squared.data());
    for (std::size_t k = 0; k < found; ++k) order[k] = {squared[k], indices[k]};
    // Where many points are at one place, the point itself may not be among the nearest.
    const auto self = std::find(indices.begin(), indices.end(), p);
    if (self != indices.end())
      order[static_cast<std::size_t>(self - indices.begin())].first = -1.0F;
    std::sort(order.begin(), order.end());
    const std::size_t skip = self != indices.end() ? 1 : 0;
    for (std::size_t k = 0; k < all.count_; ++k) {
      all.squared_[p * all.count_ + k] = order[k + skip].first;
      all.indices_[p * all.count_ + k] = order[k + skip].second;
    }
  }
  return all;
}

}  // namespace strata
