// Which nodes have to be held because no term says where they are.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_GAUGE_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_GAUGE_H_

#include <cstddef>
#include <vector>

#include "core/posegraph/pose_graph.h"

namespace strata {

// Sets of nodes joined by terms.
class Components {
 public:
  explicit Components(std::size_t nodes);
  // False if they were in one set already.
  bool Join(std::size_t a, std::size_t b);
  // The first node of each component in which no node is `anchored`, ascending.
  std::vector<std::size_t> Unanchored(const std::vector<bool>& anchored);
  // The first node of the set that `node` is in.
  std::size_t Root(std::size_t node);

 private:
  std::vector<std::size_t> parent_;  // a root is the first node of its component
};

// The first node of each component of `problem` that nothing fixed and no prior holds.
std::vector<std::size_t> NodesToHold(const PoseGraphProblem& problem);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_GAUGE_H_
