#include <cstddef>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/posegraph/costs/planar_cost.h"
#include "core/posegraph/planar_pose_graph.h"
#include "core/posegraph/solver/block_cholesky.h"
#include "core/posegraph/solver/gauge.h"
#include "core/posegraph/solver/levenberg_marquardt.h"
#include "core/posegraph/solver/pose_graph_checks.h"
#include "core/posegraph/solver/robust_minimum.h"

namespace strata {
namespace {

constexpr std::size_t kHeld = static_cast<std::size_t>(-1);

class PlanarLeastSquares : public LeastSquares, public Suspects {
 public:
  PlanarLeastSquares(const PlanarPoseGraph& graph, const std::vector<bool>& held)
      : graph_(graph), weights_(graph.relative.size(), 1.0), current_(graph.poses) {
    for (const bool is_held : held) block_of_node_.push_back(is_held ? kHeld : blocks_++);
    for (std::size_t k = 0; k < graph.relative.size(); ++k) {
      if (graph.relative[k].may_be_false) suspects_.push_back(k);
    }
    trial_ = current_;
  }

  std::size_t blocks() const { return blocks_; }
  const std::vector<PlanarPose>& poses() const { return current_; }
  double weight(std::size_t term) const { return weights_[term]; }

  BlockCholesky MakeSystem() const {
    std::vector<std::pair<std::size_t, std::size_t>> pattern;
    for (const PlanarRelativeTerm& term : graph_.relative) {
      const std::size_t i = block_of_node_[term.i];
      const std::size_t j = block_of_node_[term.j];
      if (i != kHeld && j != kHeld) pattern.emplace_back(i, j);
    }
    return BlockCholesky(3, blocks_, pattern);
  }

  double Chi2Of(const std::vector<PlanarPose>& poses, std::size_t term) const {
    const PlanarRelativeTerm& t = graph_.relative[term];
    const Eigen::Vector3d e = PlanarError(poses[t.i], poses[t.j], t.T_i_j);
    return e.dot(t.information * e);
  }
  double CostOf(const std::vector<PlanarPose>& poses) const {
    double cost = 0.0;
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      if (weights_[k] > 0.0) cost += weights_[k] * Chi2Of(poses, k);
    }
    return cost;
  }

  // LeastSquares
  double Cost() const override { return CostOf(current_); }
  void Linearise(BlockCholesky& H, Eigen::VectorXd& gradient) const override;
  void AverageByKind(Eigen::VectorXd& diagonal) const override {
    for (Eigen::Index b = 0; b < diagonal.size(); b += 3) {
      diagonal.segment<2>(b).setConstant(diagonal.segment<2>(b).mean());
    }
  }
  double Try(const Eigen::VectorXd& step) override {
    for (std::size_t n = 0; n < current_.size(); ++n) {
      if (block_of_node_[n] == kHeld) continue;
      trial_[n] =
          Moved(current_[n], step.segment<3>(static_cast<Eigen::Index>(block_of_node_[n]) * 3));
    }
    return CostOf(trial_);
  }
  void Accept() override { current_ = trial_; }

  // Suspects
  std::size_t size() const override { return suspects_.size(); }
  double Chi2(std::size_t k) const override { return Chi2Of(current_, suspects_[k]); }
  double& Weight(std::size_t k) override { return weights_[suspects_[k]]; }

 private:
  const PlanarPoseGraph& graph_;
  std::vector<std::size_t> block_of_node_;
  std::size_t blocks_ = 0;
  std::vector<double> weights_;
  std::vector<std::size_t> suspects_;
  std::vector<PlanarPose> current_, trial_;
};

void Add(BlockCholesky& H, const BlockSlot& slot, const Eigen::Matrix3d& block) {
  Eigen::Map<Eigen::Matrix3d> values(H.values().data() + slot.offset);
  if (slot.transposed) {
    values += block.transpose();
  } else {
    values += block;
  }
}

void PlanarLeastSquares::Linearise(BlockCholesky& H, Eigen::VectorXd& gradient) const {
  gradient.setZero(static_cast<Eigen::Index>(blocks_) * 3);
  const auto segment = [&gradient](std::size_t block) {
    return gradient.segment<3>(static_cast<Eigen::Index>(block) * 3);
  };
  for (std::size_t k = 0; k < graph_.relative.size(); ++k) {
    if (weights_[k] == 0.0) continue;
    const PlanarRelativeTerm& term = graph_.relative[k];
    const std::size_t i = block_of_node_[term.i];
    const std::size_t j = block_of_node_[term.j];
    const PlanarDerivatives d = DifferentiatePlanar(current_[term.i], current_[term.j], term.T_i_j);
    const Eigen::Matrix3d information = weights_[k] * term.information;
    const Eigen::Vector3d weighted = information * d.error;
    if (i != kHeld) {
      Add(H, H.Slot(i, i), d.by_i.transpose() * information * d.by_i);
      segment(i) += d.by_i.transpose() * weighted;
    }
    if (j != kHeld) {
      Add(H, H.Slot(j, j), d.by_j.transpose() * information * d.by_j);
      segment(j) += d.by_j.transpose() * weighted;
    }
    if (i != kHeld && j != kHeld) {
      Add(H, H.Slot(i, j), d.by_i.transpose() * information * d.by_j);
    }
  }
}

std::vector<bool> HeldNodes(const PlanarPoseGraph& graph) {
  Components components(graph.poses.size());
  for (const PlanarRelativeTerm& term : graph.relative) components.Join(term.i, term.j);
  std::vector<bool> held = graph.fixed;
  held.resize(graph.poses.size(), false);
  for (const std::size_t node : components.Unanchored(held)) held[node] = true;
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
  PlanarLeastSquares squares(graph, HeldNodes(graph));
  if (squares.blocks() == 0) {
    solution.termination = PoseGraphTermination::kNothingToDo;
  } else {
    BlockCholesky H = squares.MakeSystem();
    STRATA_ASSIGN_OR_RETURN(
        const Minimum minimum,
        MinimiseRobustly(squares, squares, options.max_closure_chi2, options.convergence, H, stop));
    solution.iterations = minimum.iterations;
    solution.termination = minimum.termination;
  }
  solution.poses = squares.poses();
  for (std::size_t k = 0; k < graph.relative.size(); ++k) {
    solution.chi2_after += squares.Chi2Of(solution.poses, k);
    if (squares.weight(k) == 0.0) solution.rejected.push_back(k);
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
