#include "core/classification/amn/min_cut.h"

#include <algorithm>

namespace strata {

MinCut::MinCut(std::size_t nodes, std::span<const NetworkEdge> edges)
    : first_arc_(nodes + 1, 0),
      head_(2 * edges.size()),
      sister_(2 * edges.size()),
      residual_(2 * edges.size(), 0.0),
      arc_of_edge_(edges.size()),
      terminal_(nodes, 0.0),
      tree_(nodes, Tree::kFree),
      parent_(nodes, kNone),
      time_(nodes, 0),
      distance_(nodes, 0),
      is_active_(nodes, 0) {
  for (const NetworkEdge& edge : edges) {
    ++first_arc_[edge.i + 1];
    ++first_arc_[edge.j + 1];
  }
  for (std::size_t k = 0; k < nodes; ++k) first_arc_[k + 1] += first_arc_[k];
  std::vector<Index> next(first_arc_.begin(), first_arc_.end() - 1);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Index forward = next[edges[e].i]++;
    const Index backward = next[edges[e].j]++;
    head_[forward] = edges[e].j;
    head_[backward] = edges[e].i;
    sister_[forward] = backward;
    sister_[backward] = forward;
    arc_of_edge_[e] = forward;
  }
}

void MinCut::Activate(Index node) {
  if (is_active_[node] != 0) return;
  is_active_[node] = 1;
  active_.push_back(node);
}

void MinCut::PlantTrees() {
  active_.clear();
  active_begin_ = 0;
  now_ = 0;
  std::fill(is_active_.begin(), is_active_.end(), std::uint8_t{0});
  for (Index node = 0; node < terminal_.size(); ++node) {
    time_[node] = 0;
    if (terminal_[node] == 0.0) {
      tree_[node] = Tree::kFree;
      parent_[node] = kNone;
      continue;
    }
    tree_[node] = terminal_[node] > 0.0 ? Tree::kSource : Tree::kSink;
    parent_[node] = kTerminal;
    distance_[node] = 1;
    Activate(node);
  }
}

void MinCut::Solve() {
  PlantTrees();
  while (active_begin_ < active_.size()) {
    const Index node = active_[active_begin_];
    const Index meeting = tree_[node] == Tree::kFree ? kNone : Grow(node);
    if (meeting == kNone) {
      is_active_[node] = 0;
      ++active_begin_;
      continue;
    }
    ++now_;
    Augment(meeting);
    Adopt();
  }
}

MinCut::Index MinCut::Grow(Index node) {
  const Tree tree = tree_[node];
  for (Index arc = first_arc_[node]; arc < first_arc_[node + 1]; ++arc) {
    if (GrowthResidual(tree, arc) <= 0.0) continue;
    const Index other = head_[arc];
    if (tree_[other] == Tree::kFree) {
      tree_[other] = tree;
      parent_[other] = sister_[arc];
      time_[other] = time_[node];
      distance_[other] = distance_[node] + 1;
      Activate(other);
    } else if (tree_[other] != tree) {
      return tree == Tree::kSource ? arc : sister_[arc];
    } else if (time_[other] <= time_[node] && distance_[other] > distance_[node]) {
      // A shorter way to the terminal.
      parent_[other] = sister_[arc];
      time_[other] = time_[node];
      distance_[other] = distance_[node] + 1;
    }
  }
  return kNone;
}

void MinCut::MakeOrphan(Index node) {
  parent_[node] = kOrphan;
  orphans_.push_back(node);
}

void MinCut::Augment(Index meeting) {
  const Index source_end = head_[sister_[meeting]];
  const Index sink_end = head_[meeting];
  double flow = residual_[meeting];
  Index node = source_end;
  for (; parent_[node] != kTerminal; node = head_[parent_[node]]) {
    flow = std::min(flow, residual_[sister_[parent_[node]]]);
  }
  flow = std::min(flow, terminal_[node]);
  for (node = sink_end; parent_[node] != kTerminal; node = head_[parent_[node]]) {
    flow = std::min(flow, residual_[parent_[node]]);
  }
  flow = std::min(flow, -terminal_[node]);

  const auto push = [this, flow](Index arc) {
    residual_[arc] -= flow;
    residual_[sister_[arc]] += flow;
    return residual_[arc] <= 0.0;
  };
  push(meeting);
  for (node = source_end; parent_[node] != kTerminal;) {
    const Index above = head_[parent_[node]];
    if (push(sister_[parent_[node]])) MakeOrphan(node);
    node = above;
  }
  terminal_[node] -= flow;
  if (terminal_[node] <= 0.0) MakeOrphan(node);
  for (node = sink_end; parent_[node] != kTerminal;) {
    const Index above = head_[parent_[node]];
    if (push(parent_[node])) MakeOrphan(node);
    node = above;
  }
  terminal_[node] += flow;
  if (terminal_[node] >= 0.0) MakeOrphan(node);
}

void MinCut::Adopt() {
  for (std::size_t k = 0; k < orphans_.size(); ++k) AdoptOne(orphans_[k]);
  orphans_.clear();
}

MinCut::Index MinCut::DistanceToTerminal(Index node) {
  Index steps = 0;
  Index at = node;
  // Whoever was asked since the last augmentation has kept its way.
  while (time_[at] != now_) {
    const Index parent = parent_[at];
    if (parent == kOrphan || parent == kNone) return kNone;
    if (parent == kTerminal) {
      time_[at] = now_;
      distance_[at] = 1;
      break;
    }
    ++steps;
    at = head_[parent];
  }
  const Index total = steps + distance_[at];
  Index left = total;
  for (Index on = node; time_[on] != now_; on = head_[parent_[on]]) {
    time_[on] = now_;
    distance_[on] = left--;
  }
  return total;
}

void MinCut::AdoptOne(Index node) {
  const Tree tree = tree_[node];
  Index best = kNone;
  Index best_distance = kNone;
  for (Index arc = first_arc_[node]; arc < first_arc_[node + 1]; ++arc) {
    // The tree would grow from the other node to this one.
    if (tree_[head_[arc]] != tree || GrowthResidual(tree, sister_[arc]) <= 0.0) continue;
    const Index distance = DistanceToTerminal(head_[arc]);
    if (distance < best_distance) {
      best = arc;
      best_distance = distance;
    }
  }
  if (best != kNone) {
    parent_[node] = best;
    time_[node] = now_;
    distance_[node] = best_distance + 1;
    return;
  }
  for (Index arc = first_arc_[node]; arc < first_arc_[node + 1]; ++arc) {
    const Index other = head_[arc];
    if (tree_[other] != tree) continue;
    if (GrowthResidual(tree, sister_[arc]) > 0.0) Activate(other);
    const Index parent = parent_[other];
    if (parent != kTerminal && parent != kOrphan && parent != kNone && head_[parent] == node) {
      MakeOrphan(other);
    }
  }
  tree_[node] = Tree::kFree;
  parent_[node] = kNone;
}

}  // namespace strata
