#include "core/posegraph/solver/gauge.h"

#include <algorithm>
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

std::vector<std::size_t> NodesToHold(const PoseGraphProblem& problem,
                                     const std::vector<double>& prior_weights) {
  DisjointSets joined;
  for (const RelativePoseTerm& term : problem.relative) joined.Join(term.i, term.j);
  for (const PlaneTerm& term : problem.planes) {
    for (const PlaneTerm::View& view : term.views) joined.Join(view.i, term.views[0].i);
  }
  std::vector<bool> held = problem.fixed;
  held.resize(problem.T_map_scan.size(), false);
  for (std::size_t k = 0; k < problem.priors.size(); ++k) {
    if (prior_weights[k] > 0.0) held[problem.priors[k].i] = true;
  }
  return FirstUnheld(joined, held);
}

std::vector<std::size_t> NodesInDoubt(const PoseGraphProblem& problem) {
  std::vector<double> weights(problem.priors.size(), 1.0);
  const std::vector<std::size_t> to_hold = NodesToHold(problem, weights);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (problem.priors[k].may_be_false) weights[k] = 0.0;
  }
  std::vector<std::size_t> in_doubt = NodesToHold(problem, weights);
  std::erase_if(in_doubt, [&](std::size_t node) {
    return std::binary_search(to_hold.begin(), to_hold.end(), node);
  });
  return in_doubt;
}

}  // namespace strata
