#include "core/classification/neighbours.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "core/classification/box_tree.h"

namespace strata {
namespace {

using Node = BoxTree::Node;

std::uint32_t CountUpTo(std::span<const float> values, float most) {
  std::uint32_t count = 0;
  for (const float value : values) count += value <= most ? 1 : 0;
  return count;
}

std::uint32_t CountBelow(std::span<const float> values, float bound) {
  std::uint32_t count = 0;
  for (const float value : values) count += value < bound ? 1 : 0;
  return count;
}

// `count` of the values, and not many more, are up to this; all are up to `most`. Halving needs no
// branch that depends on the values, of which processors foresee every second one.
float BoundOf(std::span<const float> values, std::size_t count, float most, int halvings) {
  float least = 0.0F;
  for (int k = 0; k < halvings; ++k) {
    const float middle = 0.5F * (least + most);
    const bool enough = CountUpTo(values, middle) >= count;
    most = enough ? middle : most;
    least = enough ? least : middle;
  }
  return most;
}

// Finds the nearest points of the queries of a leaf.
class Search {
 public:
  Search(const BoxTree& queries, const BoxTree& points, std::size_t count, bool without_self)
      : queries_(queries.points()), tree_(points), count_(count), without_self_(without_self) {}

  // `put` takes the index of a query and then may ask Put() for its nearest.
  template <typename Put>
  void ForAll(const Node& leaf, const Put& put) {
    bounds_.clear();
    float reach = 0.0F;
    for (std::uint32_t q = leaf.begin; q < leaf.end; ++q) {
      bounds_.push_back(BoundNear(queries_.at(q)));
      reach = std::max(reach, bounds_.back());
    }
    // A leaf with a point far from the others reaches over too many.
    const bool together = Gather(leaf.box, reach, kMostTogether + 16 * needed());
    for (std::uint32_t q = leaf.begin; q < leaf.end; ++q) {
      const Eigen::Array3f at = queries_.at(q);
      const float bound = bounds_[q - leaf.begin];
      if (!together) Gather({at, at}, bound, std::numeric_limits<std::size_t>::max());
      Choose(at, bound);
      put(queries_.index[q]);
    }
  }

  // Of the query at hand, nearest first.
  void Put(std::uint32_t query, float* squared, std::uint32_t* indices) {
    if (!PutByRank(squared, indices)) PutSorted(without_self_ ? query : kNobody, squared, indices);
  }

 private:
  // So many points around surely hold `count` besides the query.
  std::size_t needed() const { return count_ + (without_self_ ? 1 : 0); }

  // Of points at one place nobody needs more than the first.
  std::uint32_t EndOf(const Node& leaf) const {
    const bool one_place = (leaf.box.low == leaf.box.high).all();
    return one_place ? std::min<std::size_t>(leaf.end, leaf.begin + needed()) : leaf.end;
  }

  // A squared distance within which there are enough points.
  float BoundNear(const Eigen::Array3f& from) {
    const Node& node = SmallNodeAt(from);
    const std::uint32_t end = node.right == 0 ? EndOf(node) : node.end;
    squared_.resize(std::max<std::size_t>(squared_.size(), end - node.begin));
    tree_.points().SquaredDistances(from, node.begin, end, squared_.data());
    return BoundOf({squared_.data(), end - node.begin}, needed(), node.box.SquaredReach(from), 7);
  }

  const Node& SmallNodeAt(const Eigen::Array3f& from) const {
    const std::vector<Node>& nodes = tree_.nodes();
    const auto gap = [&](std::uint32_t at) { return nodes[at].box.SquaredGap({from, from}); };
    std::uint32_t at = 0;
    while (nodes[at].right != 0) {
      const std::uint32_t next = gap(nodes[at].right) < gap(at + 1) ? nodes[at].right : at + 1;
      if (nodes[next].size() < kSeeds * needed()) break;
      at = next;
    }
    return nodes[at];
  }

  // False if there are more than `most` candidates for queries in the box.
  bool Gather(const BoxTree::Box& box, float reach, std::size_t most) {
    gathered_ = 0;
    nodes_.assign(1, 0);
    while (!nodes_.empty() && gathered_ <= most) {
      const std::uint32_t at = nodes_.back();
      const Node& node = tree_.nodes()[at];
      nodes_.pop_back();
      // Equal distances are candidates too: among them the index decides.
      if (node.box.SquaredGap(box) > reach) continue;
      if (node.right == 0) {
        GatherLeaf(node);
      } else {
        nodes_.push_back(node.right);
        nodes_.push_back(at + 1);
      }
    }
    return gathered_ <= most;
  }

  void GatherLeaf(const Node& leaf) {
    const std::size_t count = EndOf(leaf) - leaf.begin;
    if (gathered_ + count > candidates_.index.size()) candidates_.Resize(2 * (gathered_ + count));
    const auto copy = [&](const auto& from, auto& to) {
      std::copy_n(from.data() + leaf.begin, count, to.data() + gathered_);
    };
    copy(tree_.points().x, candidates_.x);
    copy(tree_.points().y, candidates_.y);
    copy(tree_.points().z, candidates_.z);
    copy(tree_.points().index, candidates_.index);
    gathered_ += count;
  }

  // The candidates within the bound, without branches.
  void Choose(const Eigen::Array3f& from, float most) {
    squared_.resize(std::max(squared_.size(), gathered_));
    found_squared_.resize(std::max(found_squared_.size(), gathered_));
    found_indices_.resize(found_squared_.size());
    candidates_.SquaredDistances(from, 0, gathered_, squared_.data());
    const float* const all = squared_.data();
    const std::uint32_t* const all_indices = candidates_.index.data();
    const float bound = BoundOf({all, gathered_}, needed(), most, 2);
    float* const to = found_squared_.data();
    std::uint32_t* const to_indices = found_indices_.data();
    std::size_t found = 0;
    for (std::size_t k = 0; k < gathered_; ++k) {
      to[found] = all[k];
      to_indices[found] = all_indices[k];
      found += all[k] <= bound ? 1 : 0;
    }
    found_ = found;
  }

  // Each goes behind as many as are nearer: many comparisons, but none to be foreseen. False where
  // distances are equal or too many.
  bool PutByRank(float* squared, std::uint32_t* indices) const {
    constexpr std::size_t kMost = 128;
    if (found_ > kMost) return false;
    const std::span<const float> all(found_squared_.data(), found_);
    std::uint32_t ranks[kMost];
    std::size_t sum = 0;
    for (std::size_t i = 0; i < found_; ++i) {
      ranks[i] = CountBelow(all, all[i]);
      sum += ranks[i];
    }
    if (sum != found_ * (found_ - 1) / 2) return false;
    // The query itself is the first.
    const std::size_t first = needed() - count_;
    for (std::size_t i = 0; i < found_; ++i) {
      const std::size_t to = ranks[i] - first;
      if (to >= count_) continue;
      squared[to] = all[i];
      indices[to] = found_indices_[i];
    }
    return true;
  }

  void PutSorted(std::uint32_t self, float* squared, std::uint32_t* indices) {
    sorted_.clear();
    for (std::size_t k = 0; k < found_; ++k) {
      if (found_indices_[k] != self) sorted_.emplace_back(found_squared_[k], found_indices_[k]);
    }
    std::partial_sort(
        sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(count_), sorted_.end());
    for (std::size_t k = 0; k < count_; ++k) std::tie(squared[k], indices[k]) = sorted_[k];
  }

  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kMostTogether = 256;
  // A bound from so many times the points needed is rarely far off.
  static constexpr std::size_t kSeeds = 3;

  const PointColumns& queries_;
  const BoxTree& tree_;
  const std::size_t count_;
  const bool without_self_;
  std::vector<float> bounds_;         // of the queries of the leaf
  std::vector<std::uint32_t> nodes_;  // to be visited
  PointColumns candidates_;
  std::size_t gathered_ = 0;  // of the candidates' room
  std::vector<float> squared_, found_squared_;
  std::vector<std::uint32_t> found_indices_;
  std::size_t found_ = 0;
  std::vector<std::pair<float, std::uint32_t>> sorted_;
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
  Search search(queries, points, count_, without_self);
  for (const Node& node : queries.nodes()) {
    if (node.right != 0) continue;
    search.ForAll(node, [&](std::uint32_t query) {
      const std::size_t to = query * count_;
      search.Put(query, squared_.data() + to, indices_.data() + to);
    });
  }
}

}  // namespace strata
