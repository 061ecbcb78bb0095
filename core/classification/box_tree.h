// Points sorted into small boxes, so that neighbours are found for a box of points at a time.
// Internal to core/classification, not installed.
#ifndef STRATA_CORE_CLASSIFICATION_BOX_TREE_H_
#define STRATA_CORE_CLASSIFICATION_BOX_TREE_H_

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

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
  };
  struct Node {
    Box box;
    std::uint32_t begin = 0, end = 0;  // points in the order of the tree
    std::uint32_t right = 0;           // the left child comes next; 0: a leaf
  };

  explicit BoxTree(std::span<const Eigen::Vector3f> points);

  const std::vector<Node>& nodes() const { return nodes_; }  // the root first
  std::uint32_t index(std::uint32_t k) const { return order_[k]; }
  Eigen::Array3f at(std::uint32_t k) const { return {x_[k], y_[k], z_[k]}; }
  // Squared distances of the points of a leaf; room for kMostInLeaf.
  void SquaredDistances(const Node& leaf, const Eigen::Array3f& from, float* to) const;

  static constexpr std::uint32_t kMostInLeaf = 16;

 private:
  void Split(std::span<const Eigen::Vector3f> points, std::uint32_t begin, std::uint32_t end);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  std::vector<float> x_, y_, z_;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_BOX_TREE_H_
