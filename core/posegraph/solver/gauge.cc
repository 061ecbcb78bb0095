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

TermWeights TermWeights::OfAll(const PoseGraphProblem& problem) {
  return {std::vector<double>(problem.relative.size(), 1.0),
          std::vector<double>(problem.priors.size(), 1.0)};
}

std::vector<std::size_t> NodesToHold(const PoseGraphProblem& problem, const TermWeights& weights) {
  DisjointSets joined;
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    if (weights.relative[k] > 0.0) joined.Join(problem.relative[k].i, problem.relative[k].j);
  }
  for (const PlaneTerm& term : problem.planes) {
    for (const PlaneTerm::View& view : term.views) joined.Join(view.i, term.views[0].i);
  }
  std::vector<bool> held = problem.fixed;
  held.resize(problem.T_map_scan.size(), false);
  for (std::size_t k = 0; k < problem.priors.size(); ++k) {
    if (weights.priors[k] > 0.0) held[problem.priors[k].i] = true;
  }
  return FirstUnheld(joined, held);
}

std::vector<std::size_t> NodesInDoubt(const PoseGraphProblem& problem) {
  DisjointSets joined;
  for (const RelativePoseTerm& term : problem.relative) {
    if (!term.may_be_false) joined.Join(term.i, term.j);
  }
  std::vector<bool> held = problem.fixed;
  held.resize(problem.T_map_scan.size(), false);
  for (const PriorTerm& term : problem.priors) {
    if (!term.may_be_false) held[term.i] = true;
  }
  for (const std::size_t node : NodesToHold(problem, TermWeights::OfAll(problem))) {
    held[node] = true;
  }
  return FirstUnheld(joined, held);
}

}  // namespace strata
