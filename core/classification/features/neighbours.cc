#include "core/classification/features/neighbours.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "core/classification/features/box_tree.h"

namespace strata {
namespace {

using Node = BoxTree::Node;

template <typename Predicate>
std::uint32_t Count(std::span<const float> values, const Predicate& predicate) {
  std::uint32_t count = 0;
  for (const float value : values) count += predicate(value) ? 1 : 0;
  return count;
}

std::uint32_t CountUpTo(std::span<const float> values, float most) {
  return Count(values, [most](float value) { return value <= most; });
}

// `count` of the values, and not many more, are up to this; all are up to `most`. Halving needs no
// branch that depends on the values, of which processors foresee every second one.
float BoundOf(std::span<const float> values, std::size_t count, float most) {
  constexpr int kHalvings = 7;
  float least = 0.0F;
  for (int k = 0; k < kHalvings; ++k) {
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

  // Nearest first; `place_of` says where those of the query with an index go.
  template <typename PlaceOf>
  void FindAll(const Node& leaf, const PlaceOf& place_of) {
    bool together = Gather(leaf.box, reach_, kMostTogether);
    float farthest = 0.0F;
    for (std::uint32_t q = leaf.begin; q < leaf.end; ++q) {
      const Eigen::Array3f at = queries_.at(q);
      if (!together || !Choose(at)) {
        reach_ = BoundNear(at);
        together = Gather(leaf.box, reach_, kMostTogether);
        if (!together) Gather({at, at}, reach_, std::numeric_limits<std::size_t>::max());
        Choose(at);
      }
      const std::uint32_t query = queries_.index[q];
      const auto [squared, indices] = place_of(query);
      SortFound();
      Put(without_self_ ? query : kNobody, squared, indices);
      last_ = squared[count_ - 1];
      farthest = std::max(farthest, last_);
    }
    reach_ = kLikely * farthest;
  }

 private:
  // So many points around surely hold `count` besides the query.
  std::size_t needed() const { return count_ + (without_self_ ? 1 : 0); }

  // Nobody needs more than the first of points at one place.
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
    return BoundOf({squared_.data(), end - node.begin}, needed(), node.box.SquaredReach(from));
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

  // Points within reach of the box, and some more. False if those are more than `most`.
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

  // The candidates that may be among the nearest, packed without branches. False if within reach
  // there are too few.
  bool Choose(const Eigen::Array3f& from) {
    squared_.resize(std::max(squared_.size(), gathered_));
    found_squared_.resize(std::max(found_squared_.size(), gathered_));
    found_indices_.resize(found_squared_.size());
    candidates_.SquaredDistances(from, 0, gathered_, squared_.data());
    const float* const all = squared_.data();
    const std::uint32_t* const all_indices = candidates_.index.data();
    const auto enough = [&](float bound) { return CountUpTo({all, gathered_}, bound) >= needed(); };
    const float likely = kLikely * last_;
    const float bound = likely < reach_ && enough(likely) ? likely : reach_;
    if (bound == reach_ && !enough(bound)) return false;
    float* const to = found_squared_.data();
    std::uint32_t* const to_indices = found_indices_.data();
    std::size_t found = 0;
    for (std::size_t k = 0; k < gathered_; ++k) {
      to[found] = all[k];
      to_indices[found] = all_indices[k];
      found += all[k] <= bound ? 1 : 0;
    }
    found_ = found;
    return true;
  }

  // Nearest first, at least as many as needed. Each goes behind as many as are nearer: many
  // comparisons, but none to be foreseen.
  void SortFound() {
    keys_.resize(std::max(keys_.size(), found_));
    if (found_ > kMostRanked) {
      for (std::size_t i = 0; i < found_; ++i) keys_[i] = KeyOf(i);
      const auto end = keys_.begin() + static_cast<std::ptrdiff_t>(found_);
      std::partial_sort(keys_.begin(), keys_.begin() + static_cast<std::ptrdiff_t>(needed()), end);
      return;
    }
    const std::span<const float> all(found_squared_.data(), found_);
    std::uint32_t ranks[kMostRanked];
    std::size_t sum = 0;
    for (std::size_t i = 0; i < found_; ++i) {
      ranks[i] = Count(all, [d = all[i]](float other) { return other < d; });
      sum += ranks[i];
    }
    const bool equal_ones = sum != found_ * (found_ - 1) / 2;
    for (std::size_t i = 0; equal_ones && i < found_; ++i) {
      ranks[i] += Count(all.first(i), [d = all[i]](float other) { return other == d; });
    }
    for (std::size_t i = 0; i < found_; ++i) keys_[ranks[i]] = KeyOf(i);
    for (std::size_t i = 1; equal_ones && i < found_; ++i) {
      const std::uint64_t key = keys_[i];
      std::size_t k = i;
      for (; k > 0 && key < keys_[k - 1]; --k) keys_[k] = keys_[k - 1];
      keys_[k] = key;
    }
  }

  // In the order of distances, then of indices.
  std::uint64_t KeyOf(std::size_t found) const {
    return std::uint64_t{std::bit_cast<std::uint32_t>(found_squared_[found])} << 32 |
           found_indices_[found];
  }

  void Put(std::uint32_t self, float* squared, std::uint32_t* indices) const {
    std::size_t to = 0;
    for (std::size_t k = 0; to < count_; ++k) {
      squared[to] = std::bit_cast<float>(static_cast<std::uint32_t>(keys_[k] >> 32));
      indices[to] = static_cast<std::uint32_t>(keys_[k]);
      to += indices[to] != self ? 1 : 0;
    }
  }

  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kMostTogether = 512;
  static constexpr std::size_t kMostRanked = 128;
  // What was the distance of the farthest neighbour tells what the next will be, squared.
  static constexpr float kLikely = 1.25F;
  // A bound from so many times the points needed is rarely far off.
  static constexpr std::size_t kSeeds = 3;

  const PointColumns& queries_;
  const BoxTree& tree_;
  const std::size_t count_;
  const bool without_self_;
  float reach_ = 0.0F;                // candidates are all within this of the leaf's box, squared
  float last_ = 0.0F;                 // squared distance of the farthest neighbour found last
  std::vector<std::uint32_t> nodes_;  // to be visited
  PointColumns candidates_;
  std::size_t gathered_ = 0;  // of the candidates' room
  std::vector<float> squared_, found_squared_;
  std::vector<std::uint32_t> found_indices_;
  std::size_t found_ = 0;
  std::vector<std::uint64_t> keys_;
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
    search.FindAll(node, [&](std::uint32_t query) {
      const std::size_t to = query * count_;
      return std::pair(squared_.data() + to, indices_.data() + to);
    });
  }
}

}  // namespace strata
