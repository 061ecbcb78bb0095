#include "core/posegraph/solver/gauge.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace strata {

Components::Components(std::size_t nodes) : parent_(nodes) {
  std::iota(parent_.begin(), parent_.end(), std::size_t{0});
}

std::size_t Components::Root(std::size_t node) {
  while (parent_[node] != node) {
    parent_[node] = parent_[parent_[node]];
    node = parent_[node];
  }
  return node;
}

bool Components::Join(std::size_t a, std::size_t b) {
  const std::size_t root_a = Root(a);
  const std::size_t root_b = Root(b);
  parent_[std::max(root_a, root_b)] = std::min(root_a, root_b);
  return root_a != root_b;
}

std::vector<std::size_t> Components::Unanchored(const std::vector<bool>& anchored) {
  std::vector<bool> held(parent_.size(), false);
  for (std::size_t i = 0; i < anchored.size(); ++i) {
    if (anchored[i]) held[Root(i)] = true;
  }
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < parent_.size(); ++i) {
    if (Root(i) == i && !held[i]) first.push_back(i);
  }
  return first;
}

std::vector<std::size_t> NodesToHold(const PoseGraphProblem& problem) {
  Components components(problem.T_map_scan.size());
  for (const RelativePoseTerm& term : problem.relative) components.Join(term.i, term.j);
  for (const PointPairsTerm& term : problem.pairs) components.Join(term.i, term.j);
  for (const PlaneTerm& term : problem.planes) {
    for (const PlaneTerm::View& view : term.views) components.Join(view.i, term.views[0].i);
  }
  std::vector<bool> anchored = problem.fixed;
  anchored.resize(problem.T_map_scan.size(), false);
  for (const PriorTerm& term : problem.priors) anchored[term.i] = true;
  return components.Unanchored(anchored);
}

}  // namespace strata
