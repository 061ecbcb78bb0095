// Ceres with automatic differentiation, as its own pose_graph_3d example does it, with g2o's error.
#ifndef STRATA_TESTS_BENCH_POSEGRAPH_PEER_H_
#define STRATA_TESTS_BENCH_POSEGRAPH_PEER_H_

#include <memory>

#include "core/geometry/pose.h"
#include "core/posegraph/pose_graph.h"

namespace strata::bench {

struct PeerSolution {
  double chi2 = 0.0;  // of Strata's error, at Ceres' poses
  int iterations = 0;
};

// Solves from the problem's poses with sparse Cholesky (SuiteSparse), one thread, the first node
// fixed, until the cost falls by less than a share of 1e-7 (Strata's default).
PeerSolution SolveWithCeres(const PoseGraphProblem& problem);

// Whitened residuals and their Jacobians of all relative poses, differentiated automatically.
class PeerEdges {
 public:
  explicit PeerEdges(const PoseGraphProblem& problem);
  ~PeerEdges();
  // Evaluates every edge; answers the sum of all numbers, so that nothing is left out.
  double Evaluate() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_POSEGRAPH_PEER_H_
