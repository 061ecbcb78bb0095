// A kd-tree over points.
// Internal to core, not installed: whoever includes it links nanoflann.
#ifndef STRATA_CORE_CLOUD_POINT_TREE_H_
#define STRATA_CORE_CLOUD_POINT_TREE_H_

#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>
#include <nanoflann.hpp>

namespace strata {

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
using PointTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointsView>,
                                        PointsView,
                                        3,
                                        std::uint32_t>;

}  // namespace strata

#endif  // STRATA_CORE_CLOUD_POINT_TREE_H_
