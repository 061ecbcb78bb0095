#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/posegraph/costs/relative_pose_cost.h"
#include "core/posegraph/pose_graph.h"
#include "core/posegraph/solver/gauge.h"
#include "core/posegraph/solver/graph_least_squares.h"
#include "core/posegraph/solver/levenberg_marquardt.h"
#include "core/posegraph/solver/pose_graph_checks.h"
#include "core/posegraph/solver/robust_minimum.h"

namespace strata {
namespace {

constexpr std::size_t kWorstNodes = 10;

// Relative poses first.
class GraphSuspects : public Suspects {
 public:
  GraphSuspects(const PoseGraphProblem& problem, GraphLeastSquares& squares) : squares_(squares) {
    for (std::size_t k = 0; k < problem.relative.size(); ++k) {
      if (problem.relative[k].may_be_false) relative_.push_back(k);
    }
    for (std::size_t k = 0; k < problem.pairs.size(); ++k) {
      if (problem.pairs[k].may_be_false) pairs_.push_back(k);
    }
  }
  std::size_t size() const override { return relative_.size() + pairs_.size(); }
  double Chi2(std::size_t k) const override {
    return k < relative_.size() ? squares_.RelativeChi2(relative_[k])
                                : squares_.PairsExcess(pairs_[k - relative_.size()]);
  }
  double& Weight(std::size_t k) override {
    return k < relative_.size() ? squares_.relative_weights()[relative_[k]]
                                : squares_.pairs_weights()[pairs_[k - relative_.size()]];
  }

 private:
  GraphLeastSquares& squares_;
  std::vector<std::size_t> relative_, pairs_;
};

PoseGraphCosts CostsOf(const PoseGraphProblem& problem, const GraphLeastSquares& squares) {
  PoseGraphCosts costs;
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    costs.relative += squares.RelativeChi2(k);
  }
  for (std::size_t k = 0; k < problem.pairs.size(); ++k) costs.pairs += squares.PairsChi2(k);
  for (std::size_t p = 0; p < problem.planes.size(); ++p) {
    for (std::size_t v = 0; v < problem.planes[p].views.size(); ++v) {
      costs.planes += squares.ViewChi2(p, v);
    }
  }
  for (std::size_t k = 0; k < problem.priors.size(); ++k) costs.priors += squares.PriorChi2(k);
  return costs;
}

std::vector<NodeResidual> WorstNodes(const PoseGraphProblem& problem, GraphLeastSquares& squares) {
  std::vector<NodeResidual> nodes(problem.T_map_scan.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n].node = n;
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    const double half = 0.5 * squares.relative_weights()[k] * squares.RelativeChi2(k);
    nodes[problem.relative[k].i].chi2 += half;
    nodes[problem.relative[k].j].chi2 += half;
  }
  for (std::size_t k = 0; k < problem.pairs.size(); ++k) {
    const double half = 0.5 * squares.pairs_weights()[k] * squares.PairsChi2(k);
    nodes[problem.pairs[k].i].chi2 += half;
    nodes[problem.pairs[k].j].chi2 += half;
  }
  for (std::size_t p = 0; p < problem.planes.size(); ++p) {
    for (std::size_t v = 0; v < problem.planes[p].views.size(); ++v) {
      nodes[problem.planes[p].views[v].i].chi2 += squares.ViewChi2(p, v);
    }
  }
  for (std::size_t k = 0; k < problem.priors.size(); ++k) {
    nodes[problem.priors[k].i].chi2 += squares.PriorChi2(k);
  }
  std::stable_sort(nodes.begin(), nodes.end(), [](const NodeResidual& a, const NodeResidual& b) {
    return a.chi2 > b.chi2;
  });
  nodes.resize(std::min(nodes.size(), kWorstNodes));
  return nodes;
}

// diag(½, ½, ½, 1, 1, 1) P: from [translation, vec q] to [rotation, translation].
Matrix6d FromG2oErrors() {
  Matrix6d A = Matrix6d::Zero();
  A.topRightCorner<3, 3>() = 0.5 * Eigen::Matrix3d::Identity();
  A.bottomLeftCorner<3, 3>().setIdentity();
  return A;
}

}  // namespace

absl::StatusOr<PoseGraphSolution> OptimizePoseGraph(const PoseGraphProblem& problem,
                                                    const PoseGraphOptions& options,
                                                    const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateOptions(options));
  STRATA_RETURN_IF_ERROR(ValidateProblem(problem));
  PoseGraphSolution solution;
  PoseGraphSummary& summary = solution.summary;
  summary.held = NodesToHold(problem);
  std::vector<bool> held = problem.fixed;
  held.resize(problem.T_map_scan.size(), false);
  for (const std::size_t node : summary.held) held[node] = true;

  const bool by_sums = options.weighting == Weighting::kLocalGlobal;
  // Twice (7.21), so that ½ is kCovariance.
  GraphLeastSquares squares(problem,
                            held,
                            by_sums ? 2.0 * options.local_weight : 1.0,
                            by_sums ? 2.0 * (1.0 - options.local_weight) : 1.0);
  summary.before = CostsOf(problem, squares);
  if (squares.blocks() == 0) {
    summary.termination = PoseGraphTermination::kNothingToDo;
  } else {
    BlockCholesky H = squares.MakeSystem();
    GraphSuspects suspects(problem, squares);
    STRATA_ASSIGN_OR_RETURN(
        const Minimum minimum,
        MinimiseRobustly(
            squares, suspects, options.max_closure_chi2, options.convergence, H, stop));
    summary.iterations = minimum.iterations;
    summary.termination = minimum.termination;
  }
  summary.after = CostsOf(problem, squares);
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    if (squares.relative_weights()[k] > 0.0) continue;
    summary.rejected_relative.push_back({.term = k, .chi2 = squares.RelativeChi2(k)});
  }
  for (std::size_t k = 0; k < problem.pairs.size(); ++k) {
    if (squares.pairs_weights()[k] > 0.0) continue;
    summary.rejected_pairs.push_back({.term = k, .chi2 = squares.PairsExcess(k)});
  }
  summary.worst_nodes = WorstNodes(problem, squares);
  solution.T_map_scan = squares.poses();
  solution.planes = squares.planes();
  return solution;
}

double Chi2(const PoseGraphProblem& problem) {
  double chi2 = 0.0;
  for (const RelativePoseTerm& term : problem.relative) {
    const Vector6d e =
        RelativePoseError(problem.T_map_scan[term.i], problem.T_map_scan[term.j], term.T_i_j);
    chi2 += e.dot(term.information * e);
  }
  return chi2;
}

Matrix6d InformationFromG2o(const Matrix6d& information) {
  const Matrix6d A = FromG2oErrors();
  return A * information * A.transpose();
}

Matrix6d InformationToG2o(const Matrix6d& information) {
  const Matrix6d A = FromG2oErrors().inverse();
  return A * information * A.transpose();
}

}  // namespace strata
