// Parts of a pose graph: nodes that something joins.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_PARTS_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_PARTS_H_

#include <cstddef>
#include <vector>

#include "core/common/disjoint_sets.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// By the first `end` relative poses, but for the `rejected` ones.
DisjointSets JoinedBy(const std::vector<RelativePoseTerm>& relative,
                      const std::vector<bool>& rejected,
                      std::size_t end);

// Of each of `nodes` nodes: the least node of its part.
std::vector<std::size_t> PartsOf(DisjointSets& joined, std::size_t nodes);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_PARTS_H_
