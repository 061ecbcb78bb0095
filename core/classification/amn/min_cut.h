// Minimum cuts of sparse graphs (Boykov, Kolmogorov: An Experimental Comparison of Min-Cut/Max-Flow
// Algorithms for Energy Minimization in Vision, 2004: two search trees that outlive augmentations).
#ifndef STRATA_CORE_CLASSIFICATION_AMN_MIN_CUT_H_
#define STRATA_CORE_CLASSIFICATION_AMN_MIN_CUT_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/classification/amn/network.h"

namespace strata {

// Finds which nodes belong to the source and which to the sink. The edges are given once, their
// capacities for every cut. Not thread-safe.
class MinCut {
 public:
  // Edges between different nodes, both below `nodes`.
  MinCut(std::size_t nodes, std::span<const NetworkEdge> edges);

  // Capacity of source → node minus that of node → sink: only the difference decides.
  void SetTerminal(std::size_t node, double source_minus_sink) {
    terminal_[node] = source_minus_sink;
  }
  // Capacities i → j and j → i of edge `e`, both ≥ 0.
  void SetEdge(std::size_t e, double forward, double backward) {
    residual_[arc_of_edge_[e]] = forward;
    residual_[sister_[arc_of_edge_[e]]] = backward;
  }

  // Uses up the capacities: set all of them again before the next call.
  void Solve();
  // After Solve(). Of all minimum cuts the one with the fewest nodes on this side.
  bool OnSinkSide(std::size_t node) const { return tree_[node] == Tree::kSink; }

 private:
  enum class Tree : std::uint8_t { kFree, kSource, kSink };
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xFFFFFFFF;      // no arc
  static constexpr Index kTerminal = 0xFFFFFFFE;  // the arc to the terminal
  static constexpr Index kOrphan = 0xFFFFFFFD;    // lost its parent in this augmentation

  void PlantTrees();
  // Grows the tree of `node` by its neighbours; an arc from the source's tree to the sink's, or
  // kNone.
  Index Grow(Index node);
  void Augment(Index meeting);
  void Adopt();
  void AdoptOne(Index node);
  // Length of the way from `node` to its terminal, or kNone if it has lost it.
  Index DistanceToTerminal(Index node);
  void MakeOrphan(Index node);
  void Activate(Index node);
  // Capacity left on `arc`, which leaves a node of `tree`, in the direction in which the tree
  // grows.
  double GrowthResidual(Tree tree, Index arc) const {
    return tree == Tree::kSource ? residual_[arc] : residual_[sister_[arc]];
  }

  std::vector<Index> first_arc_;  // of every node, and one more
  std::vector<Index> head_;       // of every arc
  std::vector<Index> sister_;     // of every arc: the one back
  std::vector<double> residual_;  // of every arc
  std::vector<Index> arc_of_edge_;
  std::vector<double> terminal_;  // of every node: > 0 from the source, < 0 to the sink
  std::vector<Tree> tree_;
  std::vector<Index> parent_;    // arc of a node to its parent
  std::vector<Index> time_;      // when `distance_` was known to be right
  std::vector<Index> distance_;  // to the terminal
  std::vector<std::uint8_t> is_active_;
  std::vector<Index> active_;  // first in, first out, from active_begin_
  std::size_t active_begin_ = 0;
  std::vector<Index> orphans_;
  Index now_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_AMN_MIN_CUT_H_
