#include "core/classification/box_tree.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace strata {

BoxTree::BoxTree(std::span<const Eigen::Vector3f> points) : order_(points.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  if (!points.empty()) Split(points, 0, static_cast<std::uint32_t>(points.size()));
  for (const std::uint32_t index : order_) {
    x_.push_back(points[index].x());
    y_.push_back(points[index].y());
    z_.push_back(points[index].z());
  }
}

void BoxTree::Split(std::span<const Eigen::Vector3f> points,
                    std::uint32_t begin,
                    std::uint32_t end) {
  Node node{{points[order_[begin]], points[order_[begin]]}, begin, end};
  for (std::uint32_t k = begin + 1; k < end; ++k) {
    node.box.low = node.box.low.min(points[order_[k]].array());
    node.box.high = node.box.high.max(points[order_[k]].array());
  }
  const std::size_t self = nodes_.size();
  nodes_.push_back(node);
  if (end - begin <= kMostInLeaf) return;
  Eigen::Index axis = 0;
  (node.box.high - node.box.low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(
      order_.begin() + begin,
      order_.begin() + middle,
      order_.begin() + end,
      [&](std::uint32_t a, std::uint32_t b) { return points[a][axis] < points[b][axis]; });
  Split(points, begin, middle);
  nodes_[self].right = static_cast<std::uint32_t>(nodes_.size());
  Split(points, middle, end);
}

void BoxTree::SquaredDistances(const Node& leaf, const Eigen::Array3f& from, float* to) const {
  const std::uint32_t count = leaf.end - leaf.begin;
  const float* const x = x_.data() + leaf.begin;
  const float* const y = y_.data() + leaf.begin;
  const float* const z = z_.data() + leaf.begin;
  for (std::uint32_t k = 0; k < count; ++k) {
    const float dx = x[k] - from.x();
    const float dy = y[k] - from.y();
    const float dz = z[k] - from.z();
    to[k] = dx * dx + dy * dy + dz * dz;
  }
}

}  // namespace strata
