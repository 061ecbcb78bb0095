#include "core/posegraph/solver/optimize_pose_graph.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/posegraph/costs/relative_pose_cost.h"
#include "core/posegraph/solver/gauge.h"
#include "core/posegraph/solver/graph_problem.h"
#include "core/posegraph/solver/minimise.h"
#include "core/posegraph/solver/pose_graph_checks.h"
#include "core/posegraph/solver/robust_minimum.h"

namespace strata {
namespace {

constexpr std::size_t kWorstNodes = 10;

// Relative poses, then priors.
class Candidates : public OutlierCandidates {
 public:
  Candidates(const PoseGraphProblem& problem, GraphProblem& graph)
      : problem_(problem), graph_(graph) {
    for (std::size_t k = 0; k < problem.relative.size(); ++k) {
      if (problem.relative[k].may_be_false) relative_.push_back(k);
    }
    for (std::size_t k = 0; k < problem.priors.size(); ++k) {
      if (problem.priors[k].may_be_false) priors_.push_back(k);
    }
  }
  std::size_t size() const override { return relative_.size() + priors_.size(); }
  double Chi2(std::size_t k) const override {
    return k < relative_.size() ? graph_.RelativeChi2(relative_[k])
                                : graph_.PriorChi2(priors_[k - relative_.size()]);
  }
  double& Weight(std::size_t k) override {
    return k < relative_.size() ? graph_.relative_weights()[relative_[k]]
                                : graph_.prior_weights()[priors_[k - relative_.size()]];
  }
  std::optional<bool> Believed(std::size_t k) const override {
    return k < relative_.size() ? problem_.relative[relative_[k]].believed
                                : problem_.priors[priors_[k - relative_.size()]].believed;
  }
  // Without any prior scans that tell little of their places slide far away.
  double FirstWeight(std::size_t k) const override { return k < relative_.size() ? 0.0 : 1.0; }
  void Restart() override { graph_.Restart(); }

 private:
  const PoseGraphProblem& problem_;
  GraphProblem& graph_;
  std::vector<std::size_t> relative_, priors_;
};

PoseGraphCosts CostsOf(const PoseGraphProblem& problem, const GraphProblem& graph) {
  PoseGraphCosts costs;
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    costs.relative += graph.RelativeChi2(k);
  }
  for (std::size_t p = 0; p < problem.planes.size(); ++p) {
    for (std::size_t v = 0; v < problem.planes[p].views.size(); ++v) {
      costs.planes += graph.ViewChi2(p, v);
    }
  }
  for (std::size_t d = 0; d < problem.directions.size(); ++d) {
    for (std::size_t v = 0; v < problem.directions[d].views.size(); ++v) {
      costs.directions += graph.DirectionChi2(d, v);
    }
  }
  for (std::size_t k = 0; k < problem.priors.size(); ++k) costs.priors += graph.PriorChi2(k);
  return costs;
}

std::vector<NodeResidual> WorstNodes(const PoseGraphProblem& problem, GraphProblem& graph) {
  std::vector<NodeResidual> nodes(problem.T_map_scan.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n].node = n;
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    const double half = 0.5 * graph.relative_weights()[k] * graph.RelativeChi2(k);
    nodes[problem.relative[k].i].chi2 += half;
    nodes[problem.relative[k].j].chi2 += half;
  }
  for (std::size_t p = 0; p < problem.planes.size(); ++p) {
    for (std::size_t v = 0; v < problem.planes[p].views.size(); ++v) {
      nodes[problem.planes[p].views[v].i].chi2 += graph.ViewChi2(p, v);
    }
  }
  for (std::size_t d = 0; d < problem.directions.size(); ++d) {
    for (std::size_t v = 0; v < problem.directions[d].views.size(); ++v) {
      nodes[problem.directions[d].views[v].i].chi2 += graph.DirectionChi2(d, v);
    }
  }
  for (std::size_t k = 0; k < problem.priors.size(); ++k) {
    nodes[problem.priors[k].i].chi2 += graph.prior_weights()[k] * graph.PriorChi2(k);
  }
  std::stable_sort(nodes.begin(), nodes.end(), [](const NodeResidual& a, const NodeResidual& b) {
    return a.chi2 > b.chi2;
  });
  nodes.resize(std::min(nodes.size(), kWorstNodes));
  return nodes;
}

// Where all priors that placed a component turned out false, or all closures that joined it to
// others, it stays where it began: on the way they have moved it.
absl::Status HoldWhatLostItsPlace(const PoseGraphProblem& problem,
                                  const ConvergenceOptions& convergence,
                                  const Stop& stop,
                                  GraphProblem& graph,
                                  PoseGraphSummary& summary) {
  std::vector<std::size_t> to_hold =
      NodesToHold(problem, {graph.relative_weights(), graph.prior_weights()});
  if (to_hold == summary.held) return absl::OkStatus();
  graph.Restart();
  for (const std::size_t node : to_hold) graph.Hold(node);
  STRATA_ASSIGN_OR_RETURN(const Minimum minimum, Minimise(graph.problem(), convergence, stop));
  summary.held = std::move(to_hold);
  summary.iterations += minimum.iterations;
  summary.termination = minimum.termination;
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PoseGraphSolution> OptimizePoseGraph(const PoseGraphProblem& problem,
                                                    const PoseGraphOptions& options,
                                                    const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateOptions(options));
  STRATA_RETURN_IF_ERROR(ValidateProblem(problem));
  PoseGraphSolution solution;
  PoseGraphSummary& summary = solution.summary;
  summary.held = NodesToHold(problem, TermWeights::OfAll(problem));
  std::vector<bool> held = problem.fixed;
  held.resize(problem.T_map_scan.size(), false);
  for (const std::size_t node : summary.held) held[node] = true;

  const bool by_sums = options.weighting == Weighting::kLocalGlobal;
  // Twice (7.21), so that ½ is kCovariance.
  GraphProblem graph(problem,
                     held,
                     by_sums ? 2.0 * options.local_weight : 1.0,
                     by_sums ? 2.0 * (1.0 - options.local_weight) : 1.0);
  summary.before = CostsOf(problem, graph);
  if (problem.planes.empty() && problem.directions.empty() &&
      std::find(held.begin(), held.end(), false) == held.end()) {
    summary.termination = PoseGraphTermination::kNothingToDo;
  } else {
    Candidates candidates(problem, graph);
    STRATA_ASSIGN_OR_RETURN(const Minimum minimum,
                            MinimiseRobustly(candidates,
                                             options.max_closure_chi2,
                                             options.convergence,
                                             [&](const ConvergenceOptions& convergence) {
                                               return Minimise(graph.problem(), convergence, stop);
                                             }));
    summary.iterations = minimum.iterations;
    summary.termination = minimum.termination;
    STRATA_RETURN_IF_ERROR(
        HoldWhatLostItsPlace(problem, options.convergence, stop, graph, summary));
  }
  summary.after = CostsOf(problem, graph);
  for (std::size_t k = 0; k < problem.relative.size(); ++k) {
    if (graph.relative_weights()[k] > 0.0) continue;
    summary.rejected_relative.push_back({.term = k, .chi2 = graph.RelativeChi2(k)});
  }
  for (std::size_t k = 0; k < problem.priors.size(); ++k) {
    if (graph.prior_weights()[k] > 0.0) continue;
    summary.rejected_priors.push_back({.term = k, .chi2 = graph.PriorChi2(k)});
  }
  summary.worst_nodes = WorstNodes(problem, graph);
  solution.T_map_scan = graph.poses();
  solution.planes = graph.planes();
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

}  // namespace strata
