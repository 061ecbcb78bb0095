#include "core/posegraph/solver/gauge.h"

#include <cstddef>
#include <vector>

namespace strata {

std::vector<std::size_t> FirstUnheld(DisjointSets& sets, const std::vector<bool>& held) {
  std::vector<bool> set_held(held.size(), false);
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (held[i]) set_held[sets.Root(i)] = true;
  }
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (sets.Root(i) == i && !set_held[i]) first.push_back(i);
  }
  return first;
}

std::vector<std::size_t> NodesToHold(const PoseGraphProblem& problem) {
  DisjointSets joined;
  for (const RelativePoseTerm& term : problem.relative) joined.Join(term.i, term.j);
  for (const PlaneTerm& term : problem.planes) {
    for (const PlaneTerm::View& view : term.views) joined.Join(view.i, term.views[0].i);
  }
  std::vector<bool> held = problem.fixed;
  held.resize(problem.T_map_scan.size(), false);
  for (const PriorTerm& term : problem.priors) held[term.i] = true;
  return FirstUnheld(joined, held);
}

}  // namespace strata
