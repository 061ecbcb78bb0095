// A pose graph as a sum of squares over the blocks of its free nodes and planes.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_GRAPH_LEAST_SQUARES_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_GRAPH_LEAST_SQUARES_H_

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/posegraph/costs/plane_cost.h"
#include "core/posegraph/costs/point_pairs_cost.h"
#include "core/posegraph/pose_graph.h"
#include "core/posegraph/solver/block_cholesky.h"
#include "core/posegraph/solver/levenberg_marquardt.h"

namespace strata {

class GraphLeastSquares : public LeastSquares {
 public:
  // `problem` is valid and outlives this; `held` marks the nodes that do not move; the factors
  // weigh local (relative, pairs) and global terms (planes, priors).
  GraphLeastSquares(const PoseGraphProblem& problem,
                    const std::vector<bool>& held,
                    double local_factor,
                    double global_factor);

  std::size_t blocks() const { return blocks_; }
  // An empty system of this graph's pattern, the only one that Linearise() takes.
  BlockCholesky MakeSystem();

  double Cost() const override { return CostOf(current_); }
  void Linearise(BlockCholesky& H, Eigen::VectorXd& gradient) const override;
  void AverageByKind(Eigen::VectorXd& diagonal) const override;
  double Try(const Eigen::VectorXd& step) override;
  void Accept() override { current_ = trial_; }

  // What the terms count, 1 at first; by PoseGraphProblem::relative and pairs.
  std::vector<double>& relative_weights() { return relative_weights_; }
  std::vector<double>& pairs_weights() { return pairs_weights_; }

  // Of the current state, without weights and factors.
  double RelativeChi2(std::size_t term) const { return RelativeChi2(current_, term); }
  double PairsChi2(std::size_t term) const { return PairsChi2(current_, term); }
  // Beyond what the pairs' own best relative pose leaves.
  double PairsExcess(std::size_t term) const;
  double ViewChi2(std::size_t plane, std::size_t view) const;
  double PriorChi2(std::size_t term) const { return PriorChi2(current_, term); }

  const std::vector<Pose>& poses() const { return current_.poses; }
  std::vector<Plane> planes() const;

 private:
  static constexpr std::size_t kHeld = static_cast<std::size_t>(-1);
  static constexpr int kSize = 6;

  struct State {
    std::vector<Pose> poses;
    std::vector<MovingPlane> planes;
  };
  // Where two blocks of parameters meet; a held one is kHeld and adds nothing.
  struct Edge {
    std::size_t i = kHeld, j = kHeld;
    BlockSlot ii, ij, jj;
  };

  Edge EdgeOf(std::size_t i, std::size_t j) const {
    return {.i = i, .j = j, .ii = {}, .ij = {}, .jj = {}};
  }
  double CostOf(const State& state) const;
  double RelativeChi2(const State& state, std::size_t term) const;
  double PairsChi2(const State& state, std::size_t term) const;
  double PriorChi2(const State& state, std::size_t term) const;
  void LineariseRelative(BlockCholesky& H, Eigen::VectorXd& gradient) const;
  void LinearisePairs(BlockCholesky& H, Eigen::VectorXd& gradient) const;
  void LinearisePlanes(BlockCholesky& H, Eigen::VectorXd& gradient) const;
  void SettlePlanes(State& state) const;
  void HoldBack(BlockCholesky& H) const;
  void LinearisePriors(BlockCholesky& H, Eigen::VectorXd& gradient) const;

  const PoseGraphProblem& problem_;
  double local_factor_, global_factor_;
  std::vector<std::size_t> block_of_node_;  // kHeld or the block
  std::size_t blocks_ = 0;                  // free nodes, then planes
  std::vector<PointPairs> pairs_;
  std::vector<std::vector<PlaneView>> views_;
  std::vector<double> relative_weights_, pairs_weights_;
  std::vector<Edge> relative_edges_, pairs_edges_, prior_edges_;
  std::vector<std::vector<Edge>> view_edges_;  // i the node, j the plane
  std::vector<std::size_t> planes_only_;       // blocks of nodes that only planes bind
  State current_, trial_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_GRAPH_LEAST_SQUARES_H_
