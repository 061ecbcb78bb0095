// A plain use of Ceres on a pose graph: automatic differentiation, g2o's error, one block a pose.
#ifndef STRATA_TESTS_BENCH_POSEGRAPH_PEER_H_
#define STRATA_TESTS_BENCH_POSEGRAPH_PEER_H_

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/pose_graph.h"

namespace strata::bench {

struct PeerSolution {
  double chi2 = 0.0;  // of Strata's error, at Ceres' poses
  int iterations = 0;
};

// Solves from the problem's poses with the options of core/posegraph/solver/minimise.cc, the first
// node fixed, until the cost falls by less than a share of 1e-7 (Strata's default).
PeerSolution SolveWithCeres(const PoseGraphProblem& problem);

// Whitened residuals and Jacobians of all relative poses, as Ceres asks for them.
class EdgeCosts {
 public:
  enum class Kind { kOurs, kAutomatic };
  EdgeCosts(const PoseGraphProblem& problem, Kind kind);
  // Evaluates every edge; answers the sum of all numbers, so that nothing is left out.
  double Evaluate() const;

 private:
  std::vector<PoseBlock> blocks_;
  std::vector<std::unique_ptr<ceres::CostFunction>> costs_;
  std::vector<std::pair<std::size_t, std::size_t>> ends_;
};

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_POSEGRAPH_PEER_H_
