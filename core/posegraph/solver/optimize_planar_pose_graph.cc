#include "core/posegraph/solver/optimize_planar_pose_graph.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <ceres/problem.h>

#include "core/common/disjoint_sets.h"
#include "core/common/status.h"
#include "core/posegraph/costs/planar_cost.h"
#include "core/posegraph/solver/gauge.h"
#include "core/posegraph/solver/manifolds.h"
#include "core/posegraph/solver/minimise.h"
#include "core/posegraph/solver/pose_graph_checks.h"
#include "core/posegraph/solver/robust_minimum.h"

namespace strata {
namespace {

class PlanarProblem : public OutlierCandidates {
 public:
  PlanarProblem(const PlanarPoseGraph& graph, const std::vector<bool>& held)
      : graph_(graph),
        poses_(graph.poses),
        weights_(graph.relative.size(), 1.0),
        problem_(KeepingManifolds()) {
    for (std::size_t n = 0; n < poses_.size(); ++n) {
      problem_.AddParameterBlock(poses_[n].data(), 3, &manifold_);
      if (held[n]) problem_.SetParameterBlockConstant(poses_[n].data());
    }
    for (std::size_t k = 0; k < graph.relative.size(); ++k) {
      const PlanarRelativeTerm& term = graph.relative[k];
      if (term.may_be_false) candidates_.push_back(k);
      auto cost = std::make_unique<PlanarRelativeCost>(term.T_i_j, term.information, &weights_[k]);
      problem_.AddResidualBlock(
          cost.release(), nullptr, poses_[term.i].data(), poses_[term.j].data());
    }
  }
  PlanarProblem(const PlanarProblem&) = delete;
  PlanarProblem& operator=(const PlanarProblem&) = delete;

  ceres::Problem& problem() { return problem_; }
  const std::vector<PlanarPose>& poses() const { return poses_; }
  double weight(std::size_t term) const { return weights_[term]; }
  double Chi2Of(std::size_t term) const {
    const PlanarRelativeTerm& t = graph_.relative[term];
    const Eigen::Vector3d e = PlanarError(poses_[t.i], poses_[t.j], t.T_i_j);
    return e.dot(t.information * e);
  }

  // OutlierCandidates
  std::size_t size() const override { return candidates_.size(); }
  double Chi2(std::size_t k) const override { return Chi2Of(candidates_[k]); }
  double& Weight(std::size_t k) override { return weights_[candidates_[k]]; }

 private:
  const PlanarPoseGraph& graph_;
  std::vector<PlanarPose> poses_;
  std::vector<double> weights_;
  std::vector<std::size_t> candidates_;
  PlanarPoseManifold manifold_;
  ceres::Problem problem_;
};

std::vector<bool> HeldNodes(const PlanarPoseGraph& graph) {
  DisjointSets joined;
  for (const PlanarRelativeTerm& term : graph.relative) joined.Join(term.i, term.j);
  std::vector<bool> held = graph.fixed;
  held.resize(graph.poses.size(), false);
  for (const std::size_t node : FirstUnheld(joined, held)) held[node] = true;
  return held;
}

}  // namespace

absl::StatusOr<PlanarSolution> OptimizePlanarPoseGraph(const PlanarPoseGraph& graph,
                                                       const PlanarOptions& options,
                                                       const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateOptions(options));
  STRATA_RETURN_IF_ERROR(ValidateProblem(graph));
  PlanarSolution solution;
  solution.chi2_before = Chi2(graph);
  const std::vector<bool> held = HeldNodes(graph);
  PlanarProblem planar(graph, held);
  if (std::find(held.begin(), held.end(), false) == held.end()) {
    solution.termination = PoseGraphTermination::kNothingToDo;
  } else {
    STRATA_ASSIGN_OR_RETURN(const Minimum minimum,
                            MinimiseRobustly(planar,
                                             options.max_closure_chi2,
                                             options.convergence,
                                             [&](const ConvergenceOptions& convergence) {
                                               return Minimise(planar.problem(), convergence, stop);
                                             }));
    solution.iterations = minimum.iterations;
    solution.termination = minimum.termination;
  }
  solution.poses = planar.poses();
  for (std::size_t k = 0; k < graph.relative.size(); ++k) {
    solution.chi2_after += planar.Chi2Of(k);
    if (planar.weight(k) == 0.0) solution.rejected.push_back(k);
  }
  return solution;
}

double Chi2(const PlanarPoseGraph& graph) {
  double chi2 = 0.0;
  for (const PlanarRelativeTerm& term : graph.relative) {
    const Eigen::Vector3d e = PlanarError(graph.poses[term.i], graph.poses[term.j], term.T_i_j);
    chi2 += e.dot(term.information * e);
  }
  return chi2;
}

}  // namespace strata
