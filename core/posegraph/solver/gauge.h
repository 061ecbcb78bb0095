// Which nodes have to be held because no term says where they are.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_GAUGE_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_GAUGE_H_

#include <cstddef>
#include <vector>

#include "core/common/disjoint_sets.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// The first node of each of `sets` in which no node is `held`, ascending; `held` has all nodes.
std::vector<std::size_t> FirstUnheld(DisjointSets& sets, const std::vector<bool>& held);

// What the terms of a problem count, by PoseGraphProblem::relative and ::priors.
struct TermWeights {
  // All that there is, 1 each.
  static TermWeights OfAll(const PoseGraphProblem& problem);
  std::vector<double> relative, priors;
};

// The first node of each component of `problem` that nothing fixed and no prior of any weight
// holds. Planes and the relative poses that count join.
std::vector<std::size_t> NodesToHold(const PoseGraphProblem& problem, const TermWeights& weights);

// The first node of each component of the relative poses that are true for sure, where nothing else
// that is sure holds it: planes leave directions open, and what may be false may count nothing.
std::vector<std::size_t> NodesInDoubt(const PoseGraphProblem& problem);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_GAUGE_H_
