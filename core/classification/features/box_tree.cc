#include "core/classification/features/box_tree.h"

#include <algorithm>

namespace strata {
namespace {

constexpr std::uint32_t kMostInLeaf = 16;

}  // namespace

void PointColumns::Resize(std::size_t size) {
  x.resize(size);
  y.resize(size);
  z.resize(size);
  index.resize(size);
}

void PointColumns::SquaredDistances(const Eigen::Array3f& from,
                                    std::size_t begin,
                                    std::size_t end,
                                    float* to) const {
  const float* const xs = x.data() + begin;
  const float* const ys = y.data() + begin;
  const float* const zs = z.data() + begin;
  const float from_x = from.x();
  const float from_y = from.y();
  const float from_z = from.z();
  for (std::size_t k = 0; k < end - begin; ++k) {
    const float dx = xs[k] - from_x;
    const float dy = ys[k] - from_y;
    const float dz = zs[k] - from_z;
    to[k] = dx * dx + dy * dy + dz * dz;
  }
}

BoxTree::BoxTree(std::span<const Eigen::Vector3f> points) {
  std::vector<Point> order(points.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = {points[i].array(), i};
  if (!order.empty()) Split(order, 0);
  points_.Resize(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    points_.x[k] = order[k].at.x();
    points_.y[k] = order[k].at.y();
    points_.z[k] = order[k].at.z();
    points_.index[k] = order[k].index;
  }
}

// `begin`: the place of the first of them in the tree.
void BoxTree::Split(std::span<Point> points, std::uint32_t begin) {
  Node node{{points[0].at, points[0].at}, begin, begin + static_cast<std::uint32_t>(points.size())};
  for (const Point& point : points) {
    node.box.low = node.box.low.min(point.at);
    node.box.high = node.box.high.max(point.at);
  }
  const std::size_t self = nodes_.size();
  nodes_.push_back(node);
  if (points.size() <= kMostInLeaf) return;
  Eigen::Index axis = 0;
  if ((node.box.high - node.box.low).maxCoeff(&axis) <= 0.0F) {
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
      return a.index < b.index;
    });
    return;
  }
  const std::size_t middle = points.size() / 2;
  std::nth_element(points.begin(),
                   points.begin() + static_cast<std::ptrdiff_t>(middle),
                   points.end(),
                   [axis](const Point& a, const Point& b) { return a.at[axis] < b.at[axis]; });
  Split(points.first(middle), begin);
  nodes_[self].right = static_cast<std::uint32_t>(nodes_.size());
  Split(points.subspan(middle), begin + static_cast<std::uint32_t>(middle));
}

}  // namespace strata
