#include "core/classification/neighbours.h"

#include <algorithm>
#include <limits>

#include "core/classification/box_tree.h"

namespace strata {
namespace {

// The nearest points of all queries of one leaf, found together.
class Batch {
 public:
  Batch(const BoxTree& queries, const BoxTree& points, std::size_t count, bool without_self)
      : queries_(queries),
        points_(points),
        count_(count),
        without_self_(without_self),
        squared_(BoxTree::kMostInLeaf * count),
        indices_(BoxTree::kMostInLeaf * count) {}

  void Find(const BoxTree::Node& leaf) {
    leaf_ = leaf;
    std::fill(squared_.begin(), squared_.end(), std::numeric_limits<float>::infinity());
    std::fill(indices_.begin(), indices_.end(), std::numeric_limits<std::uint32_t>::max());
    worst_ = std::numeric_limits<float>::infinity();
    Visit(0);
  }
  // Of the k-th query of the leaf, nearest first.
  std::span<const float> squared(std::size_t k) const {
    return {squared_.data() + k * count_, count_};
  }
  std::span<const std::uint32_t> indices(std::size_t k) const {
    return {indices_.data() + k * count_, count_};
  }

 private:
  // Equal distances are looked at too: among them the index decides.
  void Visit(std::uint32_t at) {
    const BoxTree::Node& node = points_.nodes()[at];
    if (node.right == 0) {
      VisitLeaf(node);
      return;
    }
    std::uint32_t first = at + 1;
    std::uint32_t second = node.right;
    float first_gap = points_.nodes()[first].box.SquaredGap(leaf_.box);
    float second_gap = points_.nodes()[second].box.SquaredGap(leaf_.box);
    if (second_gap < first_gap || (second_gap == first_gap && Apart(second) < Apart(first))) {
      std::swap(first, second);
      std::swap(first_gap, second_gap);
    }
    if (first_gap <= worst_) Visit(first);
    if (second_gap <= worst_) Visit(second);
  }

  // Between the middles of the boxes: which child is likelier to hold what is near.
  float Apart(std::uint32_t at) const {
    const BoxTree::Box& box = points_.nodes()[at].box;
    return (box.low + box.high - leaf_.box.low - leaf_.box.high).square().sum();
  }

  void VisitLeaf(const BoxTree::Node& leaf) {
    float distances[BoxTree::kMostInLeaf];
    worst_ = 0.0F;
    for (std::uint32_t q = leaf_.begin; q < leaf_.end; ++q) {
      const Eigen::Array3f from = queries_.at(q);
      float* const squared = squared_.data() + (q - leaf_.begin) * count_;
      std::uint32_t* const indices = indices_.data() + (q - leaf_.begin) * count_;
      if (leaf.box.SquaredGap({from, from}) <= squared[count_ - 1]) {
        points_.SquaredDistances(leaf, from, distances);
        const std::uint32_t self = without_self_ ? queries_.index(q) : kNobody;
        for (std::uint32_t k = leaf.begin; k < leaf.end; ++k) {
          const float d = distances[k - leaf.begin];
          if (d > squared[count_ - 1] || points_.index(k) == self) continue;
          Insert(d, points_.index(k), squared, indices);
        }
      }
      worst_ = std::max(worst_, squared[count_ - 1]);
    }
  }

  void Insert(float d, std::uint32_t index, float* squared, std::uint32_t* indices) const {
    std::size_t k = count_;
    for (; k > 0; --k) {
      if (squared[k - 1] < d || (squared[k - 1] == d && indices[k - 1] < index)) break;
      if (k == count_) continue;
      squared[k] = squared[k - 1];
      indices[k] = indices[k - 1];
    }
    if (k == count_) return;
    squared[k] = d;
    indices[k] = index;
  }

  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  const BoxTree& queries_;
  const BoxTree& points_;
  const std::size_t count_;
  const bool without_self_;
  BoxTree::Node leaf_;
  float worst_ = 0.0F;  // of the distances that any query has as its farthest
  std::vector<float> squared_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace

Neighbours Neighbours::Find(std::span<const Eigen::Vector3f> points, std::size_t count) {
  Neighbours all;
  all.points_ = points.size();
  all.count_ = points.empty() ? 0 : std::min(count, points.size() - 1);
  if (all.count_ == 0) return all;
  const BoxTree tree(points);
  all.Fill(tree, tree, true);
  return all;
}

Neighbours Neighbours::Find(std::span<const Eigen::Vector3f> queries,
                            std::span<const Eigen::Vector3f> points,
                            std::size_t count) {
  Neighbours all;
  all.points_ = queries.size();
  all.count_ = std::min(count, points.size());
  if (all.count_ == 0) return all;
  all.Fill(BoxTree(queries), BoxTree(points), false);
  return all;
}

void Neighbours::Fill(const BoxTree& queries, const BoxTree& points, bool without_self) {
  indices_.resize(points_ * count_);
  squared_.resize(points_ * count_);
  Batch batch(queries, points, count_, without_self);
  for (const BoxTree::Node& node : queries.nodes()) {
    if (node.right != 0) continue;
    batch.Find(node);
    for (std::uint32_t q = node.begin; q < node.end; ++q) {
      const std::size_t to = queries.index(q) * count_;
      std::ranges::copy(batch.squared(q - node.begin), squared_.data() + to);
      std::ranges::copy(batch.indices(q - node.begin), indices_.data() + to);
    }
  }
}

}  // namespace strata
