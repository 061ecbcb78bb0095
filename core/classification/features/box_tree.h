// Points sorted into small boxes, so that neighbours are found for a box of points at a time.
// Internal to core/classification, not installed.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_BOX_TREE_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_BOX_TREE_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

// Points by coordinate, for loops over many of them.
struct PointColumns {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> index;

  Eigen::Array3f at(std::size_t k) const { return {x[k], y[k], z[k]}; }
  void Resize(std::size_t size);
  // From `from`, of the points from `begin` to `end`.
  void SquaredDistances(const Eigen::Array3f& from,
                        std::size_t begin,
                        std::size_t end,
                        float* to) const;
};

// A kd-tree that halves its points along the widest axis and keeps them in the order of its leaves.
// Points must be finite.
class BoxTree {
 public:
  struct Box {
    Eigen::Array3f low, high;

    // Never more than what is computed in the same way between points in them, rounding included.
    float SquaredGap(const Box& other) const {
      const Eigen::Array3f gap = (low - other.high).max(other.low - high).max(0.0F);
      return gap.x() * gap.x() + gap.y() * gap.y() + gap.z() * gap.z();
    }
    // Nor is this ever less.
    float SquaredReach(const Eigen::Array3f& from) const {
      const Eigen::Array3f reach = (high - from).max(from - low);
      return reach.x() * reach.x() + reach.y() * reach.y() + reach.z() * reach.z();
    }
  };
  struct Node {
    Box box;
    std::uint32_t begin = 0, end = 0;  // points in the order of the tree
    std::uint32_t right = 0;           // the left child comes next; 0: a leaf

    std::uint32_t size() const { return end - begin; }
  };

  explicit BoxTree(std::span<const Eigen::Vector3f> points);

  // The root first. A leaf has few points, or any number at one place, which are by index.
  const std::vector<Node>& nodes() const { return nodes_; }
  const PointColumns& points() const { return points_; }

 private:
  struct Point {
    Eigen::Array3f at;
    std::uint32_t index;
  };
  void Split(std::span<Point> points, std::uint32_t begin);

  std::vector<Node> nodes_;
  PointColumns points_;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_BOX_TREE_H_
